"""Everything pickles and copies, bit by bit: so sweeps run on other processes and machines."""

import copy
import inspect
import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import remora


@pytest.fixture(scope="module")
def samples(plan: remora.Plan, root: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """A value of each class."""
    scenes: list[remora.Scene] = []

    def guess(scene: remora.Scene) -> np.ndarray:
        scenes.append(scene)
        return plan.torques

    given = remora.plan(plan.scenario, initial_guess=guess)
    folder = tmp_path_factory.mktemp("plans")
    plan.save(folder / "a.plan.json")
    loaded = remora.Plan.load(folder / "a.plan.json")
    late = remora.plan(plan.scenario, initial_guess="heuristic", deadline_s=1e-3)
    arm = remora.Mission.from_urdf(root / "fixtures/urdf/spatial.urdf", tip="tip")
    cases = remora.scenarios()[:2]
    fast = remora.Scenario(id="fast", position=[0.0, 0.0, 5.0], target_rate=[0.0, 0.5, 0.0])
    moving = remora.Scenario(position=[0.0, -0.0, 5.0], joint_angle=[0.1, 0.2, 0.3], duration_s=900.0, nodes=40)
    model = remora.Model(root / "fixtures/models/rk4.model")
    with pytest.raises(remora.Refused) as refused:
        remora.plan(fast)
    return {
        "Comparison": [remora.compare_guesses({"heuristic": "heuristic"}, cases, integrator="euler")],
        "Flight": [remora.fly(plan, errors="typical", seed=3)],
        "Flights": [remora.fly(plan, runs=2)],
        "Mission": [remora.Mission.default(), arm, arm.replace(target={"mass_kg": 61.0})],
        "Model": [model],
        "Plan": [plan, given, loaded, late, remora.plan(remora.draw(1, seed=2, mission=arm)[0], arm, mode="feasible"),
                 remora.plan(plan.scenario, integrator="euler", initial_guess="heuristic")],
        "Refused": [refused.value],
        "Scenario": [*cases, fast, moving],
        "Scene": [scenes[0]],
        "Subproblem": [remora.subproblem(plan, 2), remora.subproblem(plan, 1, stage=1)],
        "Table": [remora.plan_many([*cases, fast], integrator="euler", keep=True)],
    }


def pickled(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


def holds(value: Any) -> dict[str, Any]:
    """Everything readable of a value, as bytes."""
    if isinstance(value, BaseException):
        return {"args": value.args, **vars(value)}
    if isinstance(value, dict):
        return {key: holds(inner) for key, inner in value.items()} | {"of": type(value).__name__}
    if isinstance(value, list | tuple):
        return {str(i): holds(inner) for i, inner in enumerate(value)}
    if isinstance(value, np.ndarray):
        return {"dtype": str(value.dtype), "bytes": value.tobytes(), "shape": value.shape}
    if not type(value).__module__.startswith("remora"):
        return {"repr": repr(value)}
    names = [name for name, of in vars(type(value)).items() if inspect.isgetsetdescriptor(of)]
    return {name: holds(getattr(value, name)) for name in names} | {"repr": repr(value)}


def test_there_is_a_sample_of_each_class(samples: dict[str, list[Any]]) -> None:
    classes = {name for name in remora.__all__ if inspect.isclass(getattr(remora, name))}
    assert samples.keys() == classes


@pytest.mark.parametrize("through", [pickled, copy.copy, copy.deepcopy])
@pytest.mark.parametrize("name", ["Comparison", "Flight", "Flights", "Mission", "Model", "Plan", "Refused", "Scenario",
                                  "Scene", "Subproblem", "Table"])
def test_what_is_sent_comes_back_bit_by_bit(
    samples: dict[str, list[Any]], name: str, through: Callable[[Any], Any]
) -> None:
    for value in samples[name]:
        again = through(value)
        assert type(again) is type(value)
        assert holds(again) == holds(value)
        if name in ("Flight", "Mission", "Model", "Plan", "Scenario"):
            assert again == value and hash(again) == hash(value)
            assert again is value or again != samples["Scenario" if name == "Mission" else "Mission"][0]


def test_a_pickled_plan_has_its_checksum_and_is_small(samples: dict[str, list[Any]], here: Path) -> None:
    for plan in samples["Plan"]:
        text = pickle.dumps(plan)
        again = pickle.loads(text)
        assert again.checksum == plan.checksum and again.record == plan.record
        plan.save("a.plan.json")
        again.save("b.plan.json")
        assert (here / "a.plan.json").read_bytes() == (here / "b.plan.json").read_bytes()
        assert len(text) < 60_000


def test_a_pickled_plan_goes_where_the_plan_goes(samples: dict[str, list[Any]]) -> None:
    plan, given = samples["Plan"][:2]
    assert (remora.subproblem(pickled(given), 1).a == remora.subproblem(given, 1).a).all()
    assert remora.fly(pickled(plan), errors="typical", seed=3) == samples["Flight"][0]
    assert len(pickled(plan).page(flights=[pickled(samples["Flight"][0])])) > 100_000
    model = pickled(samples["Model"][0])
    assert remora.plan(plan.scenario, initial_guess=model).checksum == plan.checksum


def test_equal_scenarios_have_one_hash() -> None:
    one = remora.Scenario(position=[0.0, 0.0, 5.0])
    other = remora.Scenario(position=[-0.0, 0.0, 5.0])
    assert one == other and hash(one) == hash(other) and len({one, other}) == 1
    drawn = remora.draw(100, seed=1)
    assert len({hash(case) for case in drawn}) == 100 and set(drawn) == set(remora.draw(100, seed=1))
    moved = remora.Scenario(position=[0.0, 0.0, 5.0], joint_rate=[0.0, 0.0, 1e-3])
    assert moved != one and hash(moved) != hash(one)


def flown(case: remora.Scenario, mission: remora.Mission) -> tuple[remora.Plan, remora.Flight]:
    plan = remora.plan(case, mission)
    return plan, remora.fly(plan, errors="typical", seed=1)


def test_a_sweep_over_mass_runs_on_other_processes(case: remora.Scenario) -> None:
    base = remora.Mission.default()
    missions = [base.replace(target={"mass_kg": mass}) for mass in (40.0, 60.0)]
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        futures = [pool.submit(flown, case, mission) for mission in missions]
        found = [future.result() for future in futures]
        fast = remora.Scenario(id="fast", position=[0.0, 0.0, 5.0], target_rate=[0.0, 0.5, 0.0])
        refused = pool.submit(remora.plan, fast).exception()
    for mission, (plan, flight) in zip(missions, found, strict=True):
        assert plan.mission == mission and plan.checksum == remora.plan(case, mission).checksum
        assert flight == remora.fly(plan, errors="typical", seed=1)
    assert isinstance(refused, remora.Refused) and refused.constraint in str(refused)
