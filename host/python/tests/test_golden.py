"""One checksum behind every door: plans have the bits of the Rust planner's."""

import csv
from pathlib import Path

import pytest

import remora

#: Public scenarios, from the first.
COUNT = 12


def golden(root: Path) -> dict[str, dict[str, str]]:
    """Checksums by scenario and way of planning."""
    with open(root / "fixtures/golden/public.csv", newline="") as file:
        return {row["scenario"]: row for row in csv.DictReader(file)}


# Verifies REM-DOR-005.
@pytest.mark.parametrize("guess", ["heuristic", "model"])
@pytest.mark.parametrize("integrator", ["euler", "rk4:4"])
def test_plans_have_the_golden_bits(root: Path, integrator: str, guess: str) -> None:
    cases = remora.scenarios()[:COUNT]
    table = remora.plan_many(cases, integrator=integrator, initial_guess=guess, jobs=2)
    expected = [golden(root)[case.id][f"{integrator} optimal {guess}"] for case in cases]
    assert list(table["checksum"]) == expected
    assert list(table["scenario"]) == [case.id for case in cases]


def test_one_plan_has_the_bits_of_many(root: Path) -> None:
    case = remora.scenarios()[7]
    for mode in ("optimal", "feasible"):
        plan = remora.plan(case, integrator="rk4:4", mode=mode, initial_guess="heuristic")
        assert plan.checksum == golden(root)[case.id][f"rk4:4 {mode} heuristic"]
        assert plan.record is not None and plan.record["output"] == plan.checksum


def test_an_explicit_mission_is_the_built_in_one(root: Path) -> None:
    given = remora.Mission.from_toml(root / "fixtures/missions/default.mission.toml")
    assert given == remora.Mission.default()
    case = remora.scenarios()[1]
    plan = remora.plan(case, given, integrator="euler", initial_guess="heuristic")
    assert plan.checksum == golden(root)[case.id]["euler optimal heuristic"]
