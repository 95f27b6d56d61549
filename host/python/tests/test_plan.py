"""Plans: what they hold, whom their memory belongs to, which thread made them."""

import gc
import pickle
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import remora


def test_a_plan_says_what_it_is(plan: remora.Plan) -> None:
    assert plan.is_verified and plan.verdict == "optimal" and plan.status == "solved"
    assert plan.start == "model" and plan.integrator == "rk4"
    assert all(plan.residuals[name] <= most for name, most in plan.tolerances.items())
    assert min(plan.clearances.values()) >= 0.0
    first, second, whole = plan.times_s
    assert 0.0 < first + second < whole
    assert min(plan.iterations) >= 1 and min(plan.costs) > 0.0
    assert repr(plan) == "<remora.Plan pub-000: optimal>"


def test_arrays_have_a_row_a_node(plan: remora.Plan) -> None:
    shapes = {
        "position": (60, 3),
        "velocity": (60, 3),
        "force": (59, 3),
        "attitude": (60, 4),
        "joint_angle": (60, 3),
        "rate": (60, 3),
        "joint_rate": (60, 3),
        "torques": (59, 6),
        "target_attitude": (60, 4),
        "target_rate": (60, 3),
        "time": (60,),
    }
    for name, shape in shapes.items():
        array = getattr(plan, name)
        assert array.shape == shape and array.dtype == np.float64, name
        assert array.flags.owndata and array.flags.writeable, name
    assert plan.time[-1] == pytest.approx(1200.0)
    assert np.abs(np.linalg.norm(plan.attitude, axis=1) - 1.0).max() < 1e-9
    assert (np.abs(plan.torques) <= plan.mission.torque_limits * (1 + 1e-6)).all()
    assert (plan.position[0] == plan.scenario.position).all()


def test_the_end_effector_ends_at_the_port(plan: remora.Plan) -> None:
    """Kinematics of the built-in mission's planar arm, from its documentation alone."""

    def turned(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return v + 2.0 * np.cross(q[:3], np.cross(q[:3], v) + q[3] * v)

    scene_miss: list[float] = []

    def look(scene: remora.Scene) -> np.ndarray:
        state = np.concatenate([plan.attitude[-1], plan.joint_angle[-1], plan.rate[-1], plan.joint_rate[-1]])
        scene_miss.append(scene.miss(state))
        return np.zeros((59, 6))

    remora.plan(plan.scenario, initial_guess=look)
    assert scene_miss[0] < 1e-3
    # The boresight sees the target's middle or near it.
    sight = -plan.position[0] / np.linalg.norm(plan.position[0])
    assert turned(plan.attitude[0], np.array([0.0, 0.0, 1.0])) @ sight > 0.9


def test_an_array_outlives_its_plan_and_is_nobody_elses(case: remora.Scenario) -> None:
    plan = remora.plan(case, integrator="euler", mode="feasible")
    attitude, mission, again = plan.attitude, plan.mission, plan.attitude
    kept = attitude.copy()
    again[:] = 7.0
    del plan, again
    gc.collect()
    assert (attitude == kept).all()
    assert mission.joints == 3
    # The other way round: the plan outlives what it was made of.
    case = remora.scenarios()[3]
    plan = remora.plan(case, mission, integrator="euler", mode="feasible")
    del case, mission, attitude
    gc.collect()
    assert plan.scenario.id == "pub-003" and plan.attitude.shape == (60, 4)


def test_two_threads_plan_what_one_does() -> None:
    cases = remora.scenarios()[:6]

    def sums(case: remora.Scenario) -> str:
        return remora.plan(case, integrator="euler").checksum

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(sums, cases)) == [sums(case) for case in cases]


def test_others_run_while_one_plans(case: remora.Scenario) -> None:
    """The interpreter's lock is released: this thread counts while another plans."""
    with ThreadPoolExecutor(1) as pool:
        planned = pool.submit(remora.plan, case, integrator="rk4", initial_guess="heuristic")
        count = 0
        while not planned.done():
            count += 1
    assert count > 1000 and planned.result().is_verified


def test_a_plan_is_saved_and_loaded(plan: remora.Plan, here: Path) -> None:
    plan.save("a.plan.json")
    assert sorted(path.name for path in here.iterdir()) == ["a.evidence.json", "a.plan.json"]
    loaded = remora.Plan.load("a.plan.json")
    assert loaded.checksum == plan.checksum and loaded.record == plan.record
    assert loaded.is_verified and loaded.residuals == plan.residuals
    assert (loaded.torques == plan.torques).all()
    assert loaded.mission == plan.mission and loaded.scenario == plan.scenario


def test_a_packet_is_the_same_plan(plan: remora.Plan, here: Path) -> None:
    plan.save("a.plan.postcard")
    assert sorted(path.name for path in here.iterdir()) == ["a.evidence.postcard", "a.plan.postcard"]
    loaded = remora.Plan.load("a.plan.postcard")
    assert loaded.checksum == plan.checksum and loaded.record == plan.record
    assert (here / "a.plan.postcard").stat().st_size < 20_000


def test_a_file_that_lies_is_found_out(plan: remora.Plan, here: Path) -> None:
    plan.save("a.plan.json")
    text = (here / "a.plan.json").read_text()
    changed, count = re.subn(r'("joint_torque_n_m": \[\s*\[)[^,]*', r"\g<1>0.004", text)
    assert count == 1
    (here / "b.plan.json").write_text(changed)
    lying = remora.Plan.load("b.plan.json")
    assert not lying.is_verified and lying.verdict == "not_flyable"
    assert lying.residuals["dynamics2"] > lying.tolerances["dynamics2"]


def test_a_plan_is_drawn(plan: remora.Plan, here: Path) -> None:
    text = plan.svg("a.svg")
    assert text.startswith("<svg") and "pub-000" in text
    assert (here / "a.svg").read_text() == text


def test_missions_and_scenarios_can_be_sent(case: remora.Scenario) -> None:
    mission = remora.Mission.default()
    assert pickle.loads(pickle.dumps(mission)) == mission
    assert pickle.loads(pickle.dumps(case)) == case


def test_a_deadline_ends_a_plan(case: remora.Scenario) -> None:
    late = remora.plan(case, initial_guess="heuristic", deadline_s=1e-3)
    assert late.status == "deadline" and not late.is_verified


def test_scenarios_are_drawn_the_same_everywhere() -> None:
    cases = remora.draw(8, seed=1)
    assert [case.id for case in cases[:2]] == ["s1-000", "s1-001"]
    assert remora.draw(3, seed=1) == cases[:3]
    assert remora.draw(3, seed=2) != cases[:3]
    # The numbers of the library's own test, bit for bit.
    assert cases[7].target_attitude[0] == -0.5295960066505896
    assert cases[7].velocity[2] == -0.00397447309848463
    assert len(remora.scenarios()) == 60


def test_an_arm_of_a_urdf_is_planned_for(root: Path) -> None:
    mission = remora.Mission.from_urdf(root / "fixtures/urdf/spatial.urdf", tip="tip")
    assert mission.joints != 3 and mission.torque_limits.shape == (3 + mission.joints,)
    case = remora.draw(1, seed=2, mission=mission)[0]
    plan = remora.plan(case, mission, mode="feasible")
    assert plan.joint_angle.shape == (60, mission.joints)
    # The built-in model is for three joints: what was asked for was dropped.
    assert plan.start == "fallback"


def test_a_moving_start_is_planned_from(plan: remora.Plan) -> None:
    """What is left of a plan, from a node of it."""
    k = 20
    case = remora.Scenario(
        id="later",
        position=plan.position[k],
        velocity=plan.velocity[k],
        target_attitude=plan.target_attitude[k],
        target_rate=rotated_back(plan.target_attitude[k], plan.target_rate[k]),
        bus_attitude=plan.attitude[k],
        bus_rate=plan.rate[k],
        joint_angle=plan.joint_angle[k],
        joint_rate=plan.joint_rate[k],
        duration_s=plan.time[-1] - plan.time[k],
        nodes=60 - k,
    )
    left = remora.plan(case, initial_guess=(plan, plan.time[k]))
    assert left.is_verified and left.start == "nominal"
    assert left.position.shape == (40, 3)
    assert left.iterations[1] < remora.plan(case, initial_guess="heuristic").iterations[1]


def rotated_back(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A vector of RTN in the axes of a body with this attitude."""
    return v + 2.0 * np.cross(-q[:3], np.cross(-q[:3], v) + q[3] * v)
