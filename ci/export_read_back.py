#!/usr/bin/env python3
"""What `remora export` writes, read by other people's readers and held to the plan's own numbers.

    pip install -r ci/export.requirements.txt
    ci/export_read_back.py FOLDER --plan PLAN --epoch TIME --chief FILE

Ephemerides are read by `oem` and `ccsds-ndm`, recordings by `mcap`. What they must hold is computed here from
the plan's JSON and the chief's TOML alone: Kepler's equation in mean anomalies (or a numerical integration,
where the chief is given as a state), RTN axes, Hill's equations integrated between the nodes.

Exit status 1 where a position is farther off than 1 mm, an attitude than 1e-6 rad, or anything else is not
as it must be.
"""

import argparse
from bisect import bisect_right
from datetime import datetime, timezone
import json
from pathlib import Path
import sys
import tomllib

from astropy.time import Time, TimeDelta
from ccsds_ndm.ndm_io import NdmIo
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
import numpy as np
from oem import OrbitEphemerisMessage

POSITION, VELOCITY, ATTITUDE = 1e-3, 1e-6, 1e-6
# Between nodes an attitude is held to a cubic through the nodes' attitudes and rates, which is no dynamics.
CUBIC = 1e-5
WORST = {}


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--plan", type=Path, required=True)
    parser.add_argument("--epoch", type=datetime.fromisoformat, required=True)
    parser.add_argument("--chief", type=Path, required=True)
    return parser.parse_args()


def hold(what, off, bound):
    """Keeps the largest of each kind; what is beyond its bound, or no number, ends the program."""
    WORST[what] = (max(WORST.get(what, (0.0, bound))[0], off), bound)
    if not off <= bound:
        sys.exit(f"{what}: {off:.3e} is beyond {bound:.0e}")


def matrix(q):
    """Rotation matrix of (x, y, z, w)."""
    x, y, z, w = np.asarray(q) / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def angle(a, b):
    """Angle of the rotation between two matrices, to full precision near zero."""
    d = a.T @ b
    sine = np.linalg.norm([d[2, 1] - d[1, 2], d[0, 2] - d[2, 0], d[1, 0] - d[0, 1]]) / 2
    return float(np.arctan2(sine, (np.trace(d) - 1) / 2))


def rotation_vector(m):
    sine = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]) / 2
    size = np.linalg.norm(sine)
    return sine if size < 1e-12 else sine * (np.arctan2(size, (np.trace(m) - 1) / 2) / size)


def turn(axis, by):
    c, s = np.cos(by), np.sin(by)
    return np.array({"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis])


def rk4(rate, x, dt, steps):
    h = dt / steps
    for _ in range(steps):
        a = rate(x)
        b = rate(x + h / 2 * a)
        c = rate(x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c))
    return x


class Chief:
    """The target's orbit, from the file and the mission."""

    def __init__(self, file, orbit):
        self.mu, self.center = orbit["gravitational_parameter_m3_s2"], orbit.get("body", "EARTH")
        text = tomllib.loads(file.read_text())
        self.frame = text.get("frame", "EME2000")
        self.names = {who: text.get(who, {}) for who in ("target", "servicer")}
        self.elements, self.start = text.get("elements"), None
        if self.elements is None:
            self.start = np.array(text["state"]["position_m"] + text["state"]["velocity_m_s"])
            self.known = [(0.0, self.start)]
            return
        of = lambda key, otherwise: self.elements.get(key, otherwise)
        self.a = of("semi_major_axis_m", orbit["semi_major_axis_m"])
        self.e = of("eccentricity", orbit["eccentricity"])
        inclination = np.radians(of("inclination_deg", orbit["inclination_deg"]))
        node, perigee, anomaly = (
            np.radians(self.elements[key])
            for key in ("ascending_node_deg", "argument_of_perigee_deg", "true_anomaly_deg"))
        self.axes = turn("z", node) @ turn("x", inclination) @ turn("z", perigee)
        eccentric = 2 * np.arctan2(
            np.sqrt(1 - self.e) * np.sin(anomaly / 2), np.sqrt(1 + self.e) * np.cos(anomaly / 2))
        self.mean = eccentric - self.e * np.sin(eccentric)

    def at(self, time):
        """Position, velocity, RTN axes as columns, and the axes' rate about N."""
        r, v = self.kepler(time) if self.start is None else self.integrated(time)
        momentum = np.cross(r, v)
        radial, normal = r / np.linalg.norm(r), momentum / np.linalg.norm(momentum)
        return r, v, np.column_stack([radial, np.cross(normal, radial), normal]), np.linalg.norm(momentum) / (r @ r)

    def kepler(self, time):
        mean = self.mean + np.sqrt(self.mu / self.a**3) * time
        eccentric = mean
        for _ in range(50):
            eccentric = mean + self.e * np.sin(eccentric)
        sine, cosine, flat = np.sin(eccentric), np.cos(eccentric), np.sqrt(1 - self.e**2)
        speed = np.sqrt(self.mu * self.a) / (self.a * (1 - self.e * cosine))
        return (self.axes @ [self.a * (cosine - self.e), self.a * flat * sine, 0],
                self.axes @ [-speed * sine, speed * flat * cosine, 0])

    def integrated(self, time):
        """From the latest time before it that is known."""
        begin, x = self.known[bisect_right(self.known, time, key=lambda known: known[0]) - 1]
        rate = lambda x: np.concatenate([x[3:], -self.mu / np.linalg.norm(x[:3]) ** 3 * x[:3]])
        if time > begin:
            x = rk4(rate, x, time - begin, int(np.ceil((time - begin) / 0.5)))
            if time > self.known[-1][0]:
                self.known.append((time, x))
        return x[:3], x[3:]


class Plan:
    """What stands in the plan's file."""

    def __init__(self, file):
        self.json = json.loads(file.read_text())
        mission = self.json["inputs"]["mission"]
        self.id, self.mission, self.orbit = self.json["scenario"], mission, mission["orbit"]
        one, two, target = self.json["stage1"], self.json["stage2"], self.json["target"]
        self.position, self.velocity = np.array(one["position_rtn_m"]), np.array(one["velocity_rtn_m_s"])
        self.force = np.array(one["force_rtn_n"])
        self.attitude = {"servicer": two["attitude_body_to_rtn"], "target": target["attitude_body_to_rtn"]}
        self.rate = {"servicer": np.array(two["rate_rtn_rad_s"]), "target": np.array(target["rate_rtn_rad_s"])}
        self.dt, self.nodes = self.json["grid"]["dt_s"], self.json["grid"]["nodes"]
        self.is_euler = self.json["integrator"] == "euler"
        links = mission["servicer"]["links"]
        self.mass = mission["servicer"]["bus_mass_kg"] + sum(link["mass_kg"] for link in links)
        self.n = np.sqrt(self.orbit["gravitational_parameter_m3_s2"] / self.orbit["semi_major_axis_m"] ** 3)

    def node(self, time):
        """The node before a time, and how long ago it was; within a microsecond, the node itself."""
        k = min(int((time + 2e-6) / self.dt), self.nodes - 1)
        since = time - k * self.dt
        return k, 0.0 if since < 2e-6 else since

    def place(self, time):
        """Position and velocity in RTN, by Hill's equations from the node before."""
        k, since = self.node(time)
        x = np.concatenate([self.position[k], self.velocity[k]])
        if since == 0.0:
            return x[:3], x[3:]
        n, pull = self.n, self.force[k] / self.mass
        rate = lambda x: np.concatenate([x[3:], pull + [
            3 * n * n * x[0] + 2 * n * x[4], -2 * n * x[3], -n * n * x[2]]])
        x = rk4(rate, x, since, 20)
        return x[:3], x[3:]

    def turned(self, who, time):
        """Attitude to RTN, and whether a node's own; between nodes by a cubic through attitudes and rates."""
        k, since = self.node(time)
        begin = matrix(self.attitude[who][k])
        if since == 0.0:
            return begin, True
        over = rotation_vector(matrix(self.attitude[who][k + 1]) @ begin.T)
        # The rates are those of the rotation vector, but for terms of the second order in it.
        w0, w1 = self.rate[who][k] * self.dt, self.rate[who][k + 1] * self.dt
        w1 = w1 - np.cross(over, w1) / 2 + np.cross(over, np.cross(over, w1)) / 12
        s = since / self.dt
        by = (s**3 - 2 * s**2 + s) * w0 + (3 * s**2 - 2 * s**3) * over + (s**3 - s**2) * w1
        size = np.linalg.norm(by)
        if size == 0.0:
            return begin, False
        x, y, z = by / size
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return (np.eye(3) + np.sin(size) * cross + (1 - np.cos(size)) * cross @ cross) @ begin, False


def expected(plan, chief, who, time):
    r, v, axes, rate = chief.at(time)
    if who == "target":
        return r, v, axes
    position, velocity = plan.place(time)
    return r + axes @ position, v + axes @ (velocity + np.cross([0, 0, rate], position)), axes


def check_rows(times, plan):
    """Rows at every node, in order, and every second between them unless the plan is Euler's."""
    for k in range(plan.nodes):
        hold("row at a node [s]", min(abs(times - k * plan.dt)), 1e-6)
    wanted = plan.nodes
    if not plan.is_euler:
        whole = np.arange(0, plan.dt * (plan.nodes - 1) + 1e-9)
        wanted += sum(min(abs(t - k * plan.dt) for k in range(plan.nodes)) > 1e-5 for t in whole)
    assert len(times) == wanted, f"{len(times)} rows, {wanted} expected"
    assert (np.diff(times) > 0).all(), "rows are not in order"


def check_oem(folder, plan, chief, epoch, who):
    file = folder / f"{plan.id}.{who}.oem"
    message = OrbitEphemerisMessage.open(file)
    (segment,) = message.segments
    meta = segment.metadata
    assert meta["REF_FRAME"] == chief.frame and meta["CENTER_NAME"] == chief.center and meta["TIME_SYSTEM"] == "UTC"
    assert meta["OBJECT_NAME"] == chief.names[who].get("name", who.upper()), meta["OBJECT_NAME"]
    assert meta["OBJECT_ID"] == chief.names[who].get("designator", "UNKNOWN"), meta["OBJECT_ID"]
    begin, times = Time(epoch, scale="utc"), []
    for state in segment.states:
        times.append((state.epoch - begin).to_value("sec"))
        r, v, _ = expected(plan, chief, who, times[-1])
        hold(f"OEM {who}: position [m]", np.linalg.norm(state.position * 1e3 - r), POSITION)
        hold(f"OEM {who}: velocity [m/s]", np.linalg.norm(state.velocity * 1e3 - v), VELOCITY)
    check_rows(np.array(times), plan)
    if not plan.is_euler:
        # What a reader makes of it between rows.
        for time in np.arange(0.5, times[-1] - 1, 37.0):
            state = segment(begin + TimeDelta(time, format="sec"))
            r, _, _ = expected(plan, chief, who, float(time))
            hold(f"OEM {who}: interpolated [m]", np.linalg.norm(state.position * 1e3 - r), POSITION)
    # The other reader finds the same numbers.
    other = NdmIo().from_path(file).body.segment[0].data.state_vector
    assert len(other) == len(times)
    for mine, theirs in zip(segment.states, other):
        assert [float(getattr(theirs, axis).value) for axis in "xyz"] == list(mine.position)
    return len(times)


def check_aem(folder, plan, chief, epoch, who):
    (segment,) = NdmIo().from_path(folder / f"{plan.id}.{who}.aem").body.segment
    meta = segment.metadata
    assert (meta.ref_frame_a, meta.ref_frame_b) == (chief.frame, "SC_BODY_1")
    assert meta.attitude_dir.value == "A2B" and meta.quaternion_type.value == "LAST"
    begin, times, last = Time(epoch, scale="utc"), [], None
    for state in segment.data.attitude_state:
        epoch_of, q = state.quaternion_state.epoch, state.quaternion_state.quaternion
        times.append((Time(epoch_of, scale="utc") - begin).to_value("sec"))
        q = np.array([q.q1, q.q2, q.q3, q.qc])
        hold(f"AEM {who}: norm less one", abs(np.linalg.norm(q) - 1), 1e-12)
        # CCSDS's matrix turns inertial components into the body's.
        to_body = matrix(q).T
        attitude, is_node = plan.turned(who, times[-1])
        off = angle(to_body.T, chief.at(times[-1])[2] @ attitude)
        name = "at the nodes" if is_node else "from a cubic between them"
        hold(f"AEM {who}: attitude {name} [rad]", off, ATTITUDE if is_node else CUBIC)
        assert last is None or q @ last > 0.99, "a sign has changed"
        last = q
    check_rows(np.array(times), plan)
    return len(times)


def check_mcap(folder, plan, epoch, rows):
    with open(folder / f"{plan.id}.mcap", "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        schemas = {c.topic: summary.schemas[c.schema_id] for c in summary.channels.values()}
        messages, latest, protobuf = {topic: [] for topic in schemas}, 0, DecoderFactory()
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert message.log_time >= latest, "times go back"
            latest = message.log_time
            decode = json.loads if channel.message_encoding == "json" else protobuf.decoder_for("protobuf", schema)
            messages[channel.topic].append((message.log_time, decode(message.data)))
    names = {topic: (schema.name, schema.encoding) for topic, schema in schemas.items()}
    assert names == {
        "/tf": ("foxglove.FrameTransforms", "protobuf"), "/scene": ("foxglove.SceneUpdate", "protobuf"),
        "/bus": ("foxglove.PoseInFrame", "protobuf"), "/joints": ("foxglove.JointStates", "protobuf"),
        "/controls": ("remora.Controls", "jsonschema"), "/approach": ("remora.Approach", "jsonschema"),
        "/residuals": ("remora.Residuals", "jsonschema")}, names
    once = {"/scene", "/residuals"}
    assert {t: len(m) for t, m in messages.items()} == {t: 1 if t in once else rows for t in names}
    begin = int(epoch.replace(tzinfo=timezone.utc).timestamp() * 1e6) * 1000
    assert messages["/tf"][0][0] == begin
    hold("MCAP: the last row's time [s]", abs((messages["/tf"][-1][0] - begin) * 1e-9 - plan.dt * (plan.nodes - 1)), 1e-6)
    assert messages["/residuals"][0][1] == plan.json["residuals"]
    check_scene(messages["/scene"][0][1], plan)
    for (time, frames), (_, approach), (_, joints), (_, controls), (_, bus) in zip(
            *(messages[topic] for topic in ("/tf", "/approach", "/joints", "/controls", "/bus"))):
        check_moment(plan, (time - begin) * 1e-9, frames, approach, joints, controls, bus)
    hold("MCAP: tip to port at the end, from the plan's residual [m]",
         abs(messages["/approach"][-1][1]["tip_m"] - plan.json["residuals"]["ee_position"]), 1e-6)


def check_scene(scene, plan):
    """Boxes have the mission's size, and each link a rod in its own frame."""
    entities = {entity.id: entity for entity in scene.entities}
    links = [f"link{i + 1}" for i in range(len(plan.mission["servicer"]["links"]))]
    assert set(entities) == {"target", "port", "bus", "path", *links}, set(entities)
    for name, half in (("target", plan.mission["target"]["half_extents_m"]),
                       ("bus", plan.mission["servicer"]["bus_half_extents_m"])):
        size = entities[name].cubes[0].size
        assert [size.x, size.y, size.z] == [2 * x for x in half] and entities[name].frame_id == name
    for name, link in zip(links, plan.mission["servicer"]["links"]):
        (rod,) = entities[name].cylinders
        ends = matrix(quaternion(rod.pose.orientation)) @ [0, 0, rod.size.z / 2]
        capsule_end = np.add(link["tip_m"], link.get("capsule_end_m", [0, 0, 0]))
        hold("MCAP: end of a link's rod [m]", np.linalg.norm(xyz(rod.pose.position) + ends - capsule_end), 1e-12)
        assert entities[name].frame_id == name and entities[name].frame_locked


def xyz(v):
    return np.array([v.x, v.y, v.z])


def quaternion(q):
    return np.array([q.x, q.y, q.z, q.w])


def check_moment(plan, time, frames, approach, joints, controls, bus):
    """Frames lead from RTN to the end effector where the other series say it is; nodes are the plan's."""
    def placed(name):
        at = {frame.child_frame_id: frame for frame in frames.transforms}
        r, m = np.zeros(3), np.eye(3)
        while name != "rtn":
            step = at[name]
            turned = matrix(quaternion(step.rotation))
            r, m, name = xyz(step.translation) + turned @ r, turned @ m, step.parent_frame_id
        return r, m
    tip, port, target = placed("end_effector")[0], placed("port")[0], placed("target")[1]
    off = target.T @ (tip - port) - [approach[f"tip_target_{axis}_m"] for axis in "xyz"]
    hold("MCAP: tip by the frames [m]", np.linalg.norm(off), 1e-9)
    position, _ = plan.place(time)
    hold("MCAP: centre of mass [m]",
         np.linalg.norm(position - [approach[f"position_{axis}_m"] for axis in "rtn"]), POSITION)
    assert np.array_equal(xyz(bus.pose.position), placed("bus")[0])
    k, since = plan.node(time)
    held = min(k, plan.nodes - 2)
    assert [controls[f"force_{axis}_n"] for axis in "rtn"] == list(plan.force[held])
    two = plan.json["stage2"]
    assert [controls[f"bus_torque_{axis}_n_m"] for axis in "xyz"] == two["bus_torque_body_n_m"][held]
    assert [joint.effort for joint in joints.joints] == two["joint_torque_n_m"][held]
    if since == 0.0:
        assert [joint.position for joint in joints.joints] == two["joint_angle_rad"][k]
        assert [joint.velocity for joint in joints.joints] == two["joint_rate_rad_s"][k]
        assert list(quaternion(bus.pose.orientation)) == plan.attitude["servicer"][k]
        hold("MCAP: target [rad]", angle(target, matrix(plan.attitude["target"][k])), 1e-12)


def main():
    given = options()
    plan = Plan(given.plan)
    rows = set()
    for who in ("target", "servicer"):
        for check in (check_oem, check_aem):
            rows.add(check(given.folder, plan, Chief(given.chief, plan.orbit), given.epoch, who))
    (rows,) = rows
    check_mcap(given.folder, plan, given.epoch, rows)
    print(f"{plan.id}: {rows} rows")
    for what, (off, bound) in sorted(WORST.items()):
        print(f"  {what}: {off:.2e} (at most {bound:.0e})")


if __name__ == "__main__":
    main()
