"""Bad input: an exception that names what is wrong, and no file."""

import inspect
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import remora
import remora.gym


# Verifies REM-DOR-005.
def test_files_are_named_with_field_and_reason(here: Path) -> None:
    Path("a.mission.toml").write_text("[horizon]\nduration_s = -1.0\n")
    with pytest.raises(ValueError, match=r"^a\.mission\.toml: horizon\.duration_s: "):
        remora.Mission.from_toml("a.mission.toml")
    Path("b.mission.toml").write_text("[horizon]\nseconds = 1.0\n")
    with pytest.raises(ValueError, match=r"^b\.mission\.toml: horizon\.seconds: unknown field"):
        remora.Mission.from_toml("b.mission.toml")
    with pytest.raises(ValueError, match=r"^none\.mission\.toml: no such file"):
        remora.Mission.from_toml("none.mission.toml")
    Path("a.plan.json").write_text("{}")
    with pytest.raises(ValueError, match=r"^a\.plan\.json: "):
        remora.Plan.load("a.plan.json")
    Path("a.urdf").write_text("<robot/>")
    with pytest.raises(ValueError, match=r"^a\.urdf: "):
        remora.Mission.from_urdf("a.urdf")
    Path("a.model").write_bytes(b"no model")
    with pytest.raises(ValueError, match=r"^a\.model: "):
        remora.Model("a.model")
    with pytest.raises(ValueError, match=r"^a\.scenarios\.json: "):
        remora.scenarios("a.scenarios.json")


BAD_SCENARIOS = [
    ({"position": [0.0, 0.0, 0.0]}, "scenario: servicer.position: "),
    ({"position": [np.nan, 0.0, 5.0]}, "scenario: servicer.position: "),
    ({"position": [0.0, 0.0, 5.0], "target_attitude": [0.0, 0.0, 0.0, 2.0]}, "target.attitude: not a unit quaternion"),
    ({"position": [0.0, 0.0, 5.0], "target_rate": [9.0, 0.0, 0.0]}, "scenario: target.rate: "),
    ({"position": [0.0, 0.0, 5.0], "id": "a/b"}, "scenario: id: "),
    ({"position": [0.0, 0.0, 5.0], "nodes": 500}, "scenario: nodes: "),
    ({"position": [0.0, 0.0, 5.0], "duration_s": float("inf")}, "scenario: duration_s: "),
]


@pytest.mark.parametrize(("numbers", "message"), BAD_SCENARIOS)
def test_scenarios_that_are_none(numbers: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        remora.Scenario(**numbers)  # type: ignore[arg-type]


def test_a_position_of_two_numbers_is_none() -> None:
    with pytest.raises(ValueError, match="^position: expected a sequence of length 3"):
        remora.Scenario(position=[0.0, 5.0])


def test_what_no_plan_can_end_well_is_refused_by_name() -> None:
    fast = remora.Scenario(id="fast", position=[0.0, 0.0, 5.0], target_rate=[0.0, 0.5, 0.0])
    with pytest.raises(remora.Refused, match=r"^scenario fast: ") as refused:
        remora.plan(fast)
    assert refused.value.constraint in str(refused.value)
    # Among many it is a row, not an exception.
    table = remora.plan_many([fast, remora.scenarios()[0]], integrator="euler", mode="feasible", keep=True)
    assert list(table["verified"]) == [False, True]
    assert table["reason"][0] == refused.value.constraint
    assert table.plans[0] is None and table.plans[1] is not None
    assert table["checksum"][0] == ""


BAD_CALLS: list[tuple[Callable[[remora.Scenario], object], str]] = [
    (lambda case: remora.plan(case, integrator="rk5"), 'integrator: "rk5"'),
    (lambda case: remora.plan(case, integrator="rk4:1"), 'integrator: "rk4:1"'),
    (lambda case: remora.plan(case, mode="best"), 'mode: "best"'),
    (lambda case: remora.plan(case, initial_guess="magic"), 'initial_guess: "magic"'),
    (lambda case: remora.plan(case, initial_guess=7), "initial_guess: "),  # type: ignore[arg-type]
    (lambda case: remora.plan(case, initial_guess=np.zeros((3, 6))), r"initial_guess: .*\(59, 6\)"),
    (lambda case: remora.plan(case, initial_guess=np.full((59, 6), np.nan)), r"\[0, 0\] is not finite"),
    (lambda case: remora.plan(case, initial_guess=lambda _: np.zeros((59, 3))), r"expected \(59, 6\)"),
    (lambda case: remora.plan(case, deadline_s=-1.0), "deadline_s: must be positive"),
    (lambda case: remora.plan(case, deadline_s=np.nan), "deadline_s: must be positive"),
    (lambda _: remora.draw(0), "count: must lie in"),
    (lambda _: remora.plan_many([]), "cases: holds no scenario"),
    (lambda case: remora.plan_many([case], jobs=0), "jobs: must be positive"),
    (lambda case: remora.compare_guesses({}, [case]), "at least one"),
]


@pytest.mark.parametrize(("call", "message"), BAD_CALLS)
def test_arguments_are_named(case: remora.Scenario, call: Callable[[remora.Scenario], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(case)


def test_what_an_own_guess_raises_comes_through(case: remora.Scenario) -> None:
    def broken(_: remora.Scene) -> np.ndarray:
        raise KeyError("weights")

    with pytest.raises(KeyError, match="weights"):
        remora.plan(case, initial_guess=broken)
    with pytest.raises(KeyError, match="weights"):
        remora.plan_many([case, case], initial_guess=broken, jobs=2)


def test_what_cannot_be_written_is_an_os_error(plan: remora.Plan, here: Path) -> None:
    with pytest.raises(OSError, match="none/a.plan.json"):
        plan.save("none/a.plan.json")
    with pytest.raises(OSError, match="none/a.svg"):
        plan.svg("none/a.svg")
    with pytest.raises(OSError, match="none/a.html"):
        plan.page("none/a.html")
    assert list(here.iterdir()) == []


def test_a_page_shows_no_flight_of_another_plan(plan: remora.Plan) -> None:
    other = remora.plan(remora.scenarios()[1])
    with pytest.raises(ValueError, match="^flights: are of another plan"):
        other.page(flights=[remora.fly(plan)])


def calls(plan: remora.Plan, root: Path) -> dict[str, tuple[Callable[..., object], dict[str, object]]]:
    """All entries that take arguments, with valid arguments."""
    case, flight = plan.scenario, remora.fly(plan)
    table, qp = remora.plan_many([case], integrator="euler", mode="feasible"), remora.subproblem(plan, 1)
    scenes: list[remora.Scene] = []

    def guess(scene: remora.Scene) -> np.ndarray:
        scenes.append(scene)
        return plan.torques

    remora.plan(case, initial_guess=guess)
    scene, state = scenes[0], scenes[0].initial_state
    return {
        "Scenario": (remora.Scenario, {"position": [0.0, 0.0, 5.0]}),
        "Model": (remora.Model, {"path": root / "fixtures/models/rk4.model"}),
        "draw": (remora.draw, {"count": 2}),
        "scenarios": (remora.scenarios, {}),
        "plan": (remora.plan, {"case": case, "integrator": "euler", "mode": "feasible"}),
        "plan_many": (remora.plan_many, {"cases": [case], "integrator": "euler", "mode": "feasible"}),
        "compare_guesses": (
            remora.compare_guesses,
            {"guesses": {"h": "heuristic"}, "cases": [case], "integrator": "euler", "mode": "feasible"},
        ),
        "subproblem": (remora.subproblem, {"plan": plan, "k": 1}),
        "fly": (remora.fly, {"plan": plan, "runs": 1}),
        "Mission.from_toml": (remora.Mission.from_toml, {"path": root / "fixtures/missions/default.mission.toml"}),
        "Mission.from_urdf": (
            remora.Mission.from_urdf, {"path": root / "fixtures/urdf/spatial.urdf", "tip": "tip"}
        ),
        "Mission.from_dict": (remora.Mission.from_dict, {"values": {}}),
        "Mission.to_toml": (plan.mission.to_toml, {}),
        "Plan.load": (remora.Plan.load, {"path": "a.plan.json"}),
        "Plan.save": (plan.save, {"path": "a.plan.json"}),
        "Plan.svg": (plan.svg, {}),
        "Plan.page": (plan.page, {"flights": [flight]}),
        "Scene.step": (scene.step, {"node": 0, "state": state, "torques": np.zeros(6)}),
        "Scene.rollout": (scene.rollout, {"torques": np.zeros((59, 6))}),
        "Scene.features": (scene.features, {"node": 0, "state": state}),
        "Scene.miss": (scene.miss, {"state": state}),
        "Subproblem.save": (qp.save, {"path": "a.qp.json"}),
        "Table.to_csv": (table.to_csv, {"path": "a.csv"}),
        "Table.to_parquet": (table.to_parquet, {"path": "a.parquet"}),
        "ApproachEnv": (remora.gym.ApproachEnv, {"cases": [case]}),
        "ApproachVectorEnv": (remora.gym.ApproachVectorEnv, {"num_envs": 2, "cases": [case]}),
    }


#: Values that hardly any argument takes.
WRONG = [object(), -1, 2**64, float("nan"), "none-such", b"bytes", [1, 2], [[1.0], [1.0, 2.0]], {"a": object()}]


def test_whatever_is_wrong_is_a_value_error_with_the_arguments_name(plan: remora.Plan, root: Path, here: Path) -> None:
    plan.save("a.plan.json")
    said: list[str] = []
    for entry, (call, right) in calls(plan, root).items():
        call(**right)
        names = list(inspect.signature(call).parameters)
        assert names
        for name in names:
            for wrong in WRONG:
                try:
                    call(**{**right, name: wrong})
                except (ValueError, OSError) as error:
                    # A field of a file is named with its section and a dot; a file is named by its path.
                    text = str(error).replace(".", "_")
                    if name not in text and "none-such" not in text and not text.startswith("mission: "):
                        said.append(f"{entry}({name}={wrong!r}): {error}")
                except Exception as error:
                    said.append(f"{entry}({name}={wrong!r}): {type(error).__name__}: {error}")
    assert said == []


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: remora.Scenario(position=[1, 2]), r"^position: .* length 3 \(got 2\), found \[1, 2\]$"),
        (lambda: remora.draw(-1), "^count: -1 is out of range$"),
        (lambda: remora.draw(1, seed=2**64), "^seed: 18446744073709551616 is out of range$"),
        (lambda: remora.draw(1.5), "^count: "),  # type: ignore[arg-type]
        (lambda: remora.plan(7), "^case: "),  # type: ignore[arg-type]
        (lambda: remora.plan(remora.scenarios()[0], initial_guess=[1.0, 2.0]), r"^initial_guess: has shape \(2,\)"),
        (lambda: remora.plan(remora.scenarios()[0], initial_guess=np.zeros((6, 59)).tolist()), r"shape \(59, 6\)"),
    ],
)
def test_what_a_new_user_types_wrong_is_named(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_a_guess_may_be_a_list(plan: remora.Plan) -> None:
    given = remora.plan(plan.scenario, initial_guess=plan.torques.tolist())
    assert given.checksum == remora.plan(plan.scenario, initial_guess=plan.torques).checksum
    assert given.start == "given"
