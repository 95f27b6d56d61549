"""Scenarios, plans, subproblems and flights."""

from __future__ import annotations

from os import PathLike
from typing import Literal, overload

from remora import _remora
from remora._remora import Flight, Mission, Plan, Scenario, Subproblem
from remora.guess import Guess
from remora.names import Controller, Integrator, JointControl, Mode
from remora.results import Flights


def draw(count: int, seed: int = 1, mission: Mission | None = None) -> list[Scenario]:
    """Draws scenarios from the mission's ranges: the same of a seed on every machine.

    Parameters
    ----------
    count : how many, from 1 to 1,000,000; a shorter list is the beginning of a longer one.
    seed : a whole number from 0 to 2**64 - 1.
    mission : whose ranges; None is the built-in mission.

    Returns
    -------
    Scenarios 0 to `count` of the seed, called `s{seed}-000` and so on.

    Raises
    ------
    ValueError : an argument out of its range; a mission whose geometry allows no start.
    """
    return _remora.draw(count, seed, mission)


def scenarios(path: str | PathLike[str] | None = None) -> list[Scenario]:
    """Reads scenarios.

    Parameters
    ----------
    path : a set of scenarios (`*.scenarios.json`); None is the sixty built-in ones.

    Returns
    -------
    The scenarios, in the order of the file.

    Raises
    ------
    ValueError : a file that cannot be understood, with the field and the reason.
    """
    return _remora.scenarios(path)


def plan(
    case: Scenario,
    mission: Mission | None = None,
    *,
    integrator: Integrator = "rk4",
    mode: Mode = "optimal",
    initial_guess: Guess | None = None,
    deadline_s: float | None = None,
) -> Plan:
    """Plans one approach.

    Parameters
    ----------
    case : the scenario.
    mission : what is planned for; None is the built-in mission.
    integrator : "rk4", which can be flown; "rk4:4" to "rk4:1000" with so many substeps an interval; "euler".
    mode : "optimal", or "feasible" for the first plan that satisfies every constraint.
    initial_guess : what Stage 2 starts from: "model", "heuristic", a `Model`, a `Plan`, a plan with the
        seconds since its start, torques of shape (nodes - 1, 3 + joints), or a function of a `Scene` that
        answers torques. None is "model".
    deadline_s : time for the whole plan [s]; None is as long as it takes.

    Returns
    -------
    The plan. Its `is_verified` says whether it can be flown: a plan that failed or was late is returned too.

    Raises
    ------
    Refused : no plan of the scenario can end well; `constraint` names why.
    ValueError : another argument that makes no sense.
    KeyboardInterrupt : Ctrl-C, within a second.
    """
    return _remora.plan(
        case, mission, integrator=integrator, mode=mode, initial_guess=initial_guess, deadline_s=deadline_s
    )


def subproblem(plan: Plan, k: int, *, stage: int = 2) -> Subproblem:
    """Gives one of the convex programs of a plan, for other solvers. The plan is made again, and its checksum compared.

    Parameters
    ----------
    plan : a plan of an arm of three joints.
    k : which of the stage's iterations, from 1.
    stage : 1, the path of the centre of mass, or 2, bus and arm.

    Returns
    -------
    The program with the embedded solver's answer.

    Raises
    ------
    ValueError : an iteration or a stage that there is not; a plan whose start is not known any more.
    """
    return _remora.subproblem(plan, k, stage=stage)


@overload
def fly(
    plan: Plan,
    *,
    errors: Literal["typical", "none"] | str | PathLike[str] | None = None,
    seed: int = 0,
    run: int = 0,
    runs: None = None,
    controller: Controller = "track",
    joints: JointControl = "torque",
    j2: bool = False,
    jobs: int | None = None,
) -> Flight: ...
@overload
def fly(
    plan: Plan,
    *,
    errors: Literal["typical", "none"] | str | PathLike[str] | None = None,
    seed: int = 0,
    run: int = 0,
    runs: int,
    controller: Controller = "track",
    joints: JointControl = "torque",
    j2: bool = False,
    jobs: int | None = None,
) -> Flights: ...
def fly(
    plan: Plan,
    *,
    errors: Literal["typical", "none"] | str | PathLike[str] | None = None,
    seed: int = 0,
    run: int = 0,
    runs: int | None = None,
    controller: Controller = "track",
    joints: JointControl = "torque",
    j2: bool = False,
    jobs: int | None = None,
) -> Flight | Flights:
    """Flies a plan in a world that it does not know.

    Parameters
    ----------
    plan : a plan by RK4.
    errors : "typical", a file of errors (`*.errors.toml`), or None for none.
    seed : seed of the errors, from 0 to 2**64 - 1.
    run : number of the flight; errors are drawn from seed and run.
    runs : how many flights, the first of number `run`; None is one flight.
    controller : "track" follows the plan; "replan" plans again in flight as well.
    joints : "torque", or "servo" for joints with loops of their own.
    j2 : whether the Earth's oblateness acts.
    jobs : threads for many flights; None is as many as there are cores.

    Returns
    -------
    The flight; with `runs` a list of flights, which a notebook shows as a table.

    Raises
    ------
    ValueError : an argument that makes no sense; a plan by Euler's method; a file of errors that is none.
    KeyboardInterrupt : Ctrl-C, within a second.
    """
    flown = _remora.fly(
        plan,
        errors=errors,
        seed=seed,
        run=run,
        runs=runs,
        controller=controller,
        joints=joints,
        j2=j2,
        jobs=jobs,
    )
    return Flights(flown) if isinstance(flown, list) else flown
