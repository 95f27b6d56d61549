#!/usr/bin/env python3
"""The same flights in three simulators: the truth, Pinocchio and Basilisk's MuJoCo scene.

    pip install pin==4.1.0 bsk==2.12.1 scipy
    ci/cross_flight.py FLIGHT.open-loop.json... [--bound 1e-3] [--jobs 2] [--out TABLE.md] [--sees]

The files are those of `cargo run --release -p remora-flight --example open_loop`. Each says, for each
of some worlds, what the vehicle is, how it starts, what force (inertial axes), bus torque (bus axes) and
joint torques are held from node to node, and where the truth's tip is at the nodes. Here the same is flown by
multibody codes that others have written: Pinocchio's articulated-body algorithm under SciPy's DOP853,
and MuJoCo's constraint-free dynamics under Basilisk's Runge-Kutta 7(8). They share with the truth the
data and the definition of gravity; with each other the function that computes it, below.

Everything is told relative to the target's centre of mass in axes that do not rotate, as in the files:
a body feels the gravity at its centre of mass less that at the target, and the gravity gradient.

Printed are the distances of the tips at the end, and the largest at any node. Exit status 1 where one is
beyond the bound. With `--sees`, how far from the truth's Pinocchio's tip ends where one thing is wrong on
purpose, in the world of a sphere.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
import copy
import json
from pathlib import Path
import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

RELATIVE, ABSOLUTE = 1e-12, 1e-13
# Basilisk's error control is by absolute error alone.
BASILISK_TOLERANCE = 1e-13
NAMES = ("truth", "pinocchio", "basilisk")
PAIRS = ((0, 1), (0, 2), (1, 2))


def options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--bound", type=float, default=1e-3, help="largest distance [m]")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--sees", action="store_true", help="instead, what the comparison would notice")
    parser.add_argument("--out", type=Path, help="the table of all flights as Markdown")
    return parser.parse_args()


class Gravity:
    """Gravity relative to the target's centre of mass, inertial axes."""

    def __init__(self, flight):
        self.mu, self.j2 = flight["mu_m3_s2"], flight["j2"]
        self.radius = flight["equatorial_radius_m"]
        self.gradient = 3.0 * self.mu if flight.get("gradient", True) else 0.0
        if self.mu == 0.0:
            return
        start = np.concatenate([flight["target_position_m"], flight["target_velocity_m_s"]])
        end = flight["intervals"][-1]["ends_s"]
        slope = lambda _, y: np.concatenate([y[3:], self.at(y[:3])])
        # Nowhere near rounding, which is a nanometre here: 0.1 m of it would change no gradient.
        orbit = solve_ivp(
            slope, (0.0, end + 1.0), start, "DOP853", rtol=1e-13, atol=1e-9, max_step=10.0, dense_output=True
        )
        self.target = lambda time: orbit.sol(time)[:3]

    def at(self, r):
        """Acceleration at a place from the Earth's centre [m/s^2]."""
        square = r @ r
        central = -self.mu / square**1.5 * r
        if self.j2 == 0.0:
            return central
        # The gradient of the potential's J2 term, mu J2 R^2 / (2 r^3) (3 z^2 / r^2 - 1).
        factor = -1.5 * self.j2 * self.mu * self.radius**2 / square**2.5
        height = 5.0 * r[2] ** 2 / square
        return central + factor * r * (np.array([1.0, 1.0, 3.0]) - height)

    def wrenches(self, time, bodies):
        """Force and moment, inertial axes, on each of (mass, place from the target, inertia)."""
        if self.mu == 0.0:
            return [(np.zeros(3), np.zeros(3)) for _ in bodies]
        target = self.target(time)
        there = self.at(target)
        factor = self.gradient / (target @ target) ** 2.5
        return [
            (mass * (self.at(target + place) - there), factor * np.cross(target, inertia @ target))
            for mass, place, inertia in bodies
        ]


def bodies_of(vehicle):
    """Bus and links as (mass, centre, inertia)."""
    records = [vehicle["bus"]] + [joint["link"] for joint in vehicle["joints"]]
    arrays = lambda r: (r["mass_kg"], np.array(r["center_m"]), np.array(r["inertia_kg_m2"]))
    return [arrays(record) for record in records]


def rotation(q):
    """Matrix of a quaternion (x, y, z, w)."""
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def scalar_first(matrix):
    """Quaternion (w, x, y, z) of a rotation matrix."""
    x, y, z, w = Rotation.from_matrix(matrix).as_quat()
    return [w, x, y, z]


def pinocchio(vehicle, flight):
    """Tips at the nodes by Pinocchio's articulated-body algorithm."""
    import pinocchio as pin

    bodies, n = bodies_of(vehicle), len(vehicle["joints"])
    model = pin.Model()
    model.gravity.setZero()
    place = pin.SE3.Identity()
    last = model.addJoint(0, pin.JointModelFreeFlyer(), place, "bus")
    model.appendBodyToJoint(last, pin.Inertia(*bodies[0]), pin.SE3.Identity())
    for i, joint in enumerate(vehicle["joints"]):
        place = pin.SE3(np.eye(3), np.array(joint["pivot_m"]))
        kind = pin.JointModelRevoluteUnaligned(np.array(joint["axis"]))
        last = model.addJoint(last, kind, place, f"joint{i}")
        model.appendBodyToJoint(last, pin.Inertia(*bodies[i + 1]), pin.SE3.Identity())
    model.armature = np.array([0.0] * 6 + [joint["armature_kg_m2"] for joint in vehicle["joints"]])
    data, gravity = model.createData(), Gravity(flight)
    push_at, tip = np.array(vehicle["force_point_m"]), np.array(vehicle["tip_m"])

    def external(time, q, interval):
        """Forces on each joint's body, in its axes, about its origin."""
        pin.forwardKinematics(model, data, q)
        poses = [data.oMi[i + 1] for i in range(n + 1)]
        there = [
            (mass, pose.act(center), pose.rotation @ inertia @ pose.rotation.T)
            for pose, (mass, center, inertia) in zip(poses, bodies)
        ]
        forces = pin.StdVec_Force()
        forces.append(pin.Force.Zero())
        for pose, (_, center, _), (force, moment) in zip(poses, bodies, gravity.wrenches(time, there)):
            force, moment = pose.rotation.T @ force, pose.rotation.T @ moment
            forces.append(pin.Force(force, moment + np.cross(center, force)))
        push = poses[0].rotation.T @ np.array(interval["force_n"])
        torque = np.array(interval["bus_torque_body_n_m"]) + np.cross(push_at, push)
        forces[1] = forces[1] + pin.Force(push, torque)
        return forces

    def slope(time, y, interval):
        q, v = y[: 7 + n].copy(), y[7 + n :]
        q[3:7] /= np.linalg.norm(q[3:7])
        torque = np.concatenate([np.zeros(6), interval["joint_torque_n_m"]])
        acceleration = pin.aba(model, data, q, v, torque, external(time, q, interval))
        x, y4, z, w = q[3:7]
        turn = np.array([[w, -z, y4], [z, w, -x], [-y4, x, w], [-x, -y4, -z]])
        rates = [rotation(q[3:7]) @ v[:3], 0.5 * turn @ v[3:6], v[6:], acceleration]
        return np.concatenate(rates)

    def tip_at(y):
        pin.forwardKinematics(model, data, y[: 7 + n])
        return data.oMi[last].act(tip)

    start = flight["start"]
    axes = rotation(np.array(start["attitude_body_to_inertial"]))
    y = np.concatenate(
        [
            start["position_m"],
            start["attitude_body_to_inertial"],
            start["joint_angle_rad"],
            axes.T @ start["velocity_m_s"],
            axes.T @ start["rate_rad_s"],
            start["joint_rate_rad_s"],
        ]
    )
    tips = [tip_at(y)]
    for interval in flight["intervals"]:
        span = (interval["begins_s"], interval["ends_s"])
        flown = solve_ivp(slope, span, y, "DOP853", rtol=RELATIVE, atol=ABSOLUTE, args=(interval,))
        if not flown.success:
            raise RuntimeError(flown.message)
        y = flown.y[:, -1]
        y[3:7] /= np.linalg.norm(y[3:7])
        tips.append(tip_at(y))
    return np.array(tips)


def scene_of(vehicle):
    """MuJoCo's XML of the vehicle: no geometry, no contact, a site at each centre of mass."""
    words = lambda values: " ".join(repr(float(value)) for value in values)

    def body(name, pivot, joint, record):
        # Diagonalised here: MuJoCo's own is less exact, which a flight of 20 minutes shows.
        moments, axes = np.linalg.eigh(np.array(record["inertia_kg_m2"]))
        axes *= np.linalg.det(axes)
        center = words(record["center_m"])
        return (
            f'<body name="{name}" pos="{words(pivot)}">{joint}'
            f'<inertial pos="{center}" mass="{record["mass_kg"]!r}" diaginertia="{words(moments)}"'
            f' quat="{words(scalar_first(axes))}"/>'
            f'<site name="center_{name}" pos="{center}"/>'
        )

    text = body("body0", [0, 0, 0], "<freejoint/>", vehicle["bus"])
    text += f'<site name="push" pos="{words(vehicle["force_point_m"])}"/>'
    for i, joint in enumerate(vehicle["joints"], 1):
        hinge = (
            f'<joint name="joint{i}" type="hinge" axis="{words(joint["axis"])}"'
            f' armature="{joint["armature_kg_m2"]!r}"/>'
        )
        text += body(f"body{i}", joint["pivot_m"], hinge, joint["link"])
    text += f'<site name="tip" pos="{words(vehicle["tip_m"])}"/>'
    text += "</body>" * (len(vehicle["joints"]) + 1)
    return (
        '<mujoco><compiler angle="radian" inertiafromgeom="false"/>'
        '<option gravity="0 0 0"><flag contact="disable"/></option>'
        f"<worldbody>{text}</worldbody></mujoco>"
    )


def basilisk(vehicle, flight):
    """Tips at the nodes by Basilisk's MuJoCo scene."""
    from Basilisk.architecture import messaging, sysModel
    from Basilisk.simulation import mujoco, svIntegrators
    from Basilisk.utilities import RigidBodyKinematics as kinematics

    bodies, gravity = bodies_of(vehicle), Gravity(flight)
    scene = mujoco.MJScene(scene_of(vehicle))
    scene.ModelTag = "servicer"
    integrator = svIntegrators.svIntegratorRKF78(scene)
    integrator.setRelativeTolerance(0.0)
    integrator.setAbsoluteTolerance(BASILISK_TOLERANCE)
    scene.setIntegrator(integrator)
    # Attitudes as quaternions with their derivatives: MuJoCo's own exponential step is of low order.
    scene.highOrderAttitudeIntegration = True

    def acting(name, site):
        actuator = scene.addForceTorqueActuator(name, site)
        force, torque = messaging.ForceAtSiteMsg(), messaging.TorqueAtSiteMsg()
        actuator.forceInMsg.subscribeTo(force)
        actuator.torqueInMsg.subscribeTo(torque)
        return force, torque

    def write(messages, force, torque):
        payloads = messaging.ForceAtSiteMsgPayload(), messaging.TorqueAtSiteMsgPayload()
        payloads[0].force_S, payloads[1].torque_S = force.tolist(), torque.tolist()
        for message, payload in zip(messages, payloads):
            message.write(payload)

    sites = [scene.getSite(f"center_body{i}") for i in range(len(bodies))]
    pulls = [acting(f"gravity{i}", f"center_body{i}") for i in range(len(bodies))]
    push = acting("push", "push")
    motors = []
    for i in range(1, len(bodies)):
        joint = scene.getBody(f"body{i}").getScalarJoint(f"joint{i}")
        message = messaging.SingleActuatorMsg()
        scene.addJointSingleActuator(f"motor{i}", joint).actuatorInMsg.subscribeTo(message)
        motors.append(message)

    class Forces(sysModel.SysModel):
        """What acts, asked at every stage of the integrator after the kinematics."""

        interval = flight["intervals"][0]

        def Reset(self, now):
            pass

        def UpdateState(self, now):
            states = [site.stateOutMsg.read() for site in sites]
            axes = [kinematics.MRP2C(np.array(state.sigma_BN)).T for state in states]
            if gravity.mu != 0.0:
                there = [
                    (mass, np.array(state.r_BN_N), r @ inertia @ r.T)
                    for state, r, (mass, _, inertia) in zip(states, axes, bodies)
                ]
                wrenches = gravity.wrenches(1e-9 * now, there)
                for pull, r, (force, moment) in zip(pulls, axes, wrenches):
                    write(pull, r.T @ force, r.T @ moment)
            force = axes[0].T @ np.array(self.interval["force_n"])
            write(push, force, np.array(self.interval["bus_torque_body_n_m"]))

    forces = Forces()
    forces.ModelTag = "forces"
    scene.AddModelToDynamicsTask(forces)
    for pull in pulls:
        write(pull, np.zeros(3), np.zeros(3))
    scene.SelfInit()
    scene.Reset(0)
    start = flight["start"]
    axes = rotation(np.array(start["attitude_body_to_inertial"]))
    bus = scene.getBody("body0")
    bus.setPosition(start["position_m"])
    bus.setVelocity(start["velocity_m_s"])
    bus.setAttitude(kinematics.C2MRP(axes.T).tolist())
    bus.setAttitudeRate((axes.T @ start["rate_rad_s"]).tolist())
    for i, (angle, rate) in enumerate(zip(start["joint_angle_rad"], start["joint_rate_rad_s"]), 1):
        joint = scene.getBody(f"body{i}").getScalarJoint(f"joint{i}")
        joint.setPosition(angle)
        joint.setVelocity(rate)
    tip, tips = scene.getSite("tip"), []
    # Times are whole nanoseconds there: a node is met within half of one.
    for interval in flight["intervals"]:
        forces.interval = interval
        for motor, torque in zip(motors, interval["joint_torque_n_m"]):
            payload = messaging.SingleActuatorMsgPayload()
            payload.input = torque
            motor.write(payload)
        scene.UpdateState(round(1e9 * interval["ends_s"]))
        tips.append(np.array(tip.stateOutMsg.read().r_BN_N))
    return np.array(tips)


def fly(file):
    """Rows (scenario, case, distances at the end, largest distances), a pair each."""
    document = json.loads(file.read_text())
    if document["format"] != "remora-open-loop/1":
        raise SystemExit(f"{file}: format: is {document['format']}")
    rows = []
    for flight in document["flights"]:
        vehicle = flight["vehicle"]
        truth = np.array(flight["truth"]["tip_m"])
        # Basilisk tells where it is after the first interval.
        tips = [truth[1:], pinocchio(vehicle, flight)[1:], basilisk(vehicle, flight)]
        apart = [np.linalg.norm(tips[a] - tips[b], axis=1) for a, b in PAIRS]
        ends, largest = [d[-1] for d in apart], [d.max() for d in apart]
        rows.append((document["scenario"], flight["case"], ends, largest))
    return rows


def last_joint_biased(flight):
    for interval in flight["intervals"]:
        interval["joint_torque_n_m"][-1] += 1e-9


def last_link_shifted(flight):
    flight["vehicle"]["joints"][-1]["link"]["center_m"][0] += 1e-5


def switched_at_10_hz(flight):
    for interval in flight["intervals"]:
        for key in ("begins_s", "ends_s"):
            interval[key] = round(interval[key], 1)


def without_gradient(flight):
    flight["gradient"] = False


WRONG = {
    "1e-9 N m more on the last joint": last_joint_biased,
    "0.01 mm of the last link's centre of mass": last_link_shifted,
    "switches at multiples of 0.1 s": switched_at_10_hz,
    "no gravity gradient on single bodies": without_gradient,
}


def noticed(file):
    """Distances from the truth at the end, one for each thing wrong."""
    flights = json.loads(file.read_text())["flights"]
    flight = next(flight for flight in flights if flight["case"] == "sphere")
    truth, apart = np.array(flight["truth"]["tip_m"][-1]), []
    for spoil in WRONG.values():
        wrong = copy.deepcopy(flight)
        spoil(wrong)
        apart.append(np.linalg.norm(pinocchio(wrong["vehicle"], wrong)[-1] - truth))
    return apart


def print_noticed(files, pool):
    apart = 1e3 * np.array(list(pool.map(noticed, files)))
    print(f"| wrong on purpose, {len(files)} plans | least | median | most |\n| --- | ---: | ---: | ---: |")
    for name, column in zip(WRONG, apart.T):
        print(f"| {name} | {column.min():.2g} | {np.median(column):.2g} | {column.max():.2g} |")


def line(first, second, numbers):
    return f"| {first} | {second} | " + " | ".join(f"{1e3 * n:.1e}" for n in numbers) + " |"


def main():
    given = options()
    if given.sees:
        with ProcessPoolExecutor(given.jobs) as pool:
            print_noticed(given.files, pool)
        return
    header = ["| plan | world | " + " | ".join(f"{NAMES[a]}, {NAMES[b]}" for a, b in PAIRS) + " | at any node |"]
    header.append("| --- | --- | " + " | ".join(["---:"] * (len(PAIRS) + 1)) + " |")
    print("\n".join(header), flush=True)
    lines, worst = [], {}
    with ProcessPoolExecutor(given.jobs) as pool:
        for rows in pool.map(fly, given.files):
            for scenario, case, ends, largest in rows:
                numbers = [*ends, max(largest)]
                lines.append(line(scenario, case, numbers))
                print(lines[-1], flush=True)
                worst[case] = np.maximum(worst.get(case, 0.0), numbers)
    summary = [line("largest", case, numbers) for case, numbers in worst.items()]
    print("\n".join(summary))
    if given.out:
        given.out.write_text("\n".join(header + lines + summary) + "\n")
    largest = max(numbers[-1] for numbers in worst.values())
    print(f"tips at most {1e3 * largest:.1e} mm apart; the bound is {1e3 * given.bound:.1e} mm")
    sys.exit(0 if largest <= given.bound else 1)


if __name__ == "__main__":
    main()
