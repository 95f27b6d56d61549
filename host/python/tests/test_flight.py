"""Flights: plans in a world that they do not know."""

from pathlib import Path

import numpy as np
import pytest

import remora


def test_without_errors_the_end_effector_is_at_the_port(plan: remora.Plan) -> None:
    flight = remora.fly(plan)
    assert flight.ending == "captured" and flight.is_captured and flight.violations == []
    assert flight.miss_m <= 3e-4 and flight.speed_m_s <= 5e-3
    # A row a second.
    assert flight.time.shape == (len(flight.tip),) and abs(len(flight.time) - 1200) <= 2
    assert flight.joint_angle.shape == flight.joint_rate.shape == (len(flight.time), 3)
    assert flight.torques.shape == (len(flight.time), 6)
    assert np.linalg.norm(flight.tip[-1]) < 0.05
    assert np.abs(flight.joint_angle[-1] - plan.joint_angle[-1]).max() < 5e-3
    assert flight.tip.flags.owndata


def test_the_same_seed_is_the_same_flight(plan: remora.Plan) -> None:
    first, again = (remora.fly(plan, errors="typical", seed=3, run=5) for _ in range(2))
    other = remora.fly(plan, errors="typical", seed=4, run=5)
    assert (first.tip == again.tip).all() and first.drawn == again.drawn
    assert first.miss_m == again.miss_m != other.miss_m


def test_runs_are_those_of_one_by_one(plan: remora.Plan) -> None:
    many = remora.fly(plan, errors="typical", seed=3, run=5, runs=3, jobs=2)
    assert [flight.run for flight in many] == [5, 6, 7]
    assert many[1].miss_m == remora.fly(plan, errors="typical", seed=3, run=6).miss_m
    assert len({flight.miss_m for flight in many}) == 3


def test_errors_of_a_file(plan: remora.Plan, here: Path) -> None:
    Path("a.errors.toml").write_text("[tumble]\nattitude_rad = 0.01\n")
    with pytest.raises(ValueError, match=r"^a\.errors\.toml: "):
        remora.fly(plan, errors="a.errors.toml")


def test_a_flight_says_who_flew(plan: remora.Plan) -> None:
    again = remora.fly(plan, errors="typical", seed=3, controller="replan")
    assert again.replans[0] >= again.replans[1] > 0
    assert remora.fly(plan, errors="typical", seed=3).replans == (0, 0)
    with pytest.raises(ValueError, match='controller: "pilot" is none of track, replan'):
        remora.fly(plan, controller="pilot")
    with pytest.raises(ValueError, match="runs: must be 1000000 at most"):
        remora.fly(plan, runs=10**18)
    with pytest.raises(ValueError, match="plan with rk4"):
        remora.fly(remora.plan(plan.scenario, integrator="euler", mode="feasible"))
