#!/usr/bin/env python3
"""What Pinocchio makes of a URDF, as JSON: the reference for `remora-urdf` and the dynamics.

    pip install pin==4.1.0
    ci/pinocchio_reference.py arm.urdf --end-effector tip [--hold JOINT=VALUE] [--count 100]
        [--seed 1] [--root LINK] --out arm.pinocchio.json

Joints that `--hold` names are locked where they are held, joints that mimic others are named too.
Each state is random: joint angles `q` [rad], rates `v` [rad/s] and torques `tau` [N m]. Given are
the pose of the end effector in the root link's frame, the joint-space mass matrix and the
accelerations of the arm on a fixed base without gravity. Where the root link has mass, the same
follows with it as a free-flying body: `base` holds its position, quaternion (x, y, z, w), linear
and angular velocity and the force and torque on it, these four in its own axes; the mass matrix and
the accelerations have the base's six rows first, linear before angular, then the joints.
"""

import argparse
import json
from pathlib import Path
import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio as pin


def options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("urdf", type=Path)
    parser.add_argument("--end-effector", required=True)
    parser.add_argument("--root", help="link that carries the arm; the tree's root by default")
    parser.add_argument("--hold", action="append", default=[], metavar="JOINT=VALUE")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    return parser.parse_args()


def from_root(path, root):
    """The text of the URDF, only what is at or beyond `root`, for a parser that insists on limits."""
    robot = ElementTree.parse(path).getroot()
    for joint in robot.findall("joint"):
        if joint.get("type") in ("revolute", "prismatic") and joint.find("limit") is None:
            ElementTree.SubElement(joint, "limit", lower="-1", upper="1", effort="1", velocity="1")
    for joint in robot.findall("joint"):
        # Where the base is free, the model has a joint for it already.
        if root is None and joint.get("type") == "floating":
            root = joint.find("child").get("link")
    if root is None:
        return ElementTree.tostring(robot, encoding="unicode")
    kept, joints = {root}, robot.findall("joint")
    for _ in joints:
        kept |= {j.find("child").get("link") for j in joints if j.find("parent").get("link") in kept}
    for link in robot.findall("link"):
        if link.get("name") not in kept:
            robot.remove(link)
    for joint in joints:
        if joint.find("parent").get("link") not in kept:
            robot.remove(joint)
    # Others, such as transmissions, may name joints that are gone.
    for other in [e for e in robot if e.tag not in ("link", "joint")]:
        robot.remove(other)
    return ElementTree.tostring(robot, encoding="unicode")


def locked(model, held):
    """The model with the held joints locked."""
    if not held:
        return model
    reference = pin.neutral(model)
    for name, value in held.items():
        joint = model.joints[model.getJointId(name)]
        angle = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
        reference[joint.idx_q : joint.idx_q + joint.nq] = angle
    return pin.buildReducedModel(model, [model.getJointId(name) for name in held], reference)


def arm_joints(model):
    """The joints but for the world's and the free-flying base's."""
    return [joint for joint in list(model.joints)[1:] if joint.nv == 1]


def position(model, angles, base):
    """Pinocchio's configuration; a continuous joint is its cosine and sine there."""
    parts = [base] if base is not None else []
    for joint, angle in zip(arm_joints(model), angles, strict=True):
        parts.append([np.cos(angle), np.sin(angle)] if joint.nq == 2 else [angle])
    return np.concatenate(parts)


def rows(matrix):
    return np.asarray(matrix).tolist()


def evaluate(model, q, v, tau):
    """Mass matrix and accelerations."""
    data = model.createData()
    model.gravity.setZero()
    mass = np.triu(pin.crba(model, data, q))
    mass += np.triu(mass, 1).T
    return {"mass_matrix": rows(mass), "acceleration": rows(pin.aba(model, data, q, v, tau))}


def end_effector(model, q, name):
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    pose = data.oMf[model.getFrameId(name)]
    return {"position": rows(pose.translation), "rotation": rows(pose.rotation)}


def state(rng, models, name):
    fixed, free = models
    n = fixed.nv
    q, v, tau = rng.uniform(-3, 3, n), rng.uniform(-1, 1, n), rng.uniform(-5, 5, n)
    configuration = position(fixed, q, None)
    row = {"q": rows(q), "v": rows(v), "tau": rows(tau)}
    row |= end_effector(fixed, configuration, name)
    row["fixed_base"] = evaluate(fixed, configuration, v, tau)
    if free is not None:
        attitude = rng.normal(size=4)
        attitude /= np.linalg.norm(attitude)
        place, twist, wrench = rng.uniform(-2, 2, 3), rng.uniform(-0.5, 0.5, 6), rng.uniform(-5, 5, 6)
        base = {"position": rows(place), "attitude": rows(attitude), "linear_velocity": rows(twist[:3])}
        base |= {"angular_velocity": rows(twist[3:])}
        base |= {"force": rows(wrench[:3]), "torque": rows(wrench[3:])}
        whole = position(free, q, np.concatenate([place, attitude]))
        row["base"] = base
        row["free_base"] = evaluate(
            free, whole, np.concatenate([twist, v]), np.concatenate([wrench, tau])
        )
    return row


def main():
    given = options()
    held = {name: float(value) for name, value in (h.rsplit("=", 1) for h in given.hold)}
    text = from_root(given.urdf, given.root)
    fixed = locked(pin.buildModelFromXML(text), held)
    free = locked(pin.buildModelFromXML(text, pin.JointModelFreeFlyer()), held)
    # What is fixed to the root is part of the free-flying body.
    if free.inertias[1].mass <= 0:
        free = None
    rng = np.random.default_rng(given.seed)
    states = [state(rng, (fixed, free), given.end_effector) for _ in range(given.count)]
    document = {
        "format": "remora-pinocchio/1",
        "urdf": given.urdf.name,
        "pinocchio": pin.__version__,
        "seed": given.seed,
        "end_effector": given.end_effector,
        "held": held,
        "joints": [fixed.names[joint.id] for joint in arm_joints(fixed)],
        "states": states,
    }
    given.out.write_text(json.dumps(document, separators=(",", ":")).replace('{"q"', '\n{"q"') + "\n")


if __name__ == "__main__":
    main()
