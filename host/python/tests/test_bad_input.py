"""Bad input: an exception that names what is wrong, and no file."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import remora


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
    with pytest.raises(ValueError, match="expected a sequence of length 3"):
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
