"""Many plans: a table of them, and guesses against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

from numpy.typing import NDArray

from remora import _remora
from remora._remora import Flight, Mission, Plan, Scenario
from remora.guess import Guess
from remora.names import Integrator, Mode


class Flights(list[Flight]):
    """Flights of a plan, a list; a notebook shows them as a table."""

    def _repr_html_(self) -> str:
        from remora import notebook

        return notebook.flights(self)


class Table(dict[str, NDArray[Any]]):
    """Columns of a campaign, an array each, a row a scenario: `docs/reference/tables.md` tells what they are.

    `plans` holds the plans, None for a scenario that was refused, where they were asked for.
    """

    plans: list[Plan | None]

    def __init__(self, columns: Mapping[str, NDArray[Any]], rows: _remora.Rows, plans: list[Plan | None]) -> None:
        super().__init__(columns)
        self._rows = rows
        self.plans = plans

    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Writes the table as `remora campaign` does, units in its metadata.

        Parameters
        ----------
        path : the file.

        Raises
        ------
        OSError : a file that cannot be written.
        """
        self._rows.to_parquet(path)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Writes the table with a header line; numbers read back bit for bit.

        Parameters
        ----------
        path : the file.

        Raises
        ------
        OSError : a file that cannot be written.
        """
        self._rows.to_csv(path)


class Comparison(dict[str, dict[str, Any]]):
    """What each guess comes to, with 95 % intervals, and what changes against the first.

    Rates count all scenarios, everything else those that were solved; changes count what both solved.
    """

    def __str__(self) -> str:
        lines = [f"{'guess':<16} {'solved':>8} {'iterations':>24} {'cost':>26} {'iterations against first':>28}"]
        for name, of in self.items():
            solved = f"{of['success']['count']}/{of['success']['of']}"
            iterations = _interval(of["iterations"]["mean"], ".1f")
            cost = _interval(of["cost"]["mean"], ".4f")
            change = _interval(of["against"]["iterations"], "+.1%")
            lines.append(f"{name:<16} {solved:>8} {iterations:>24} {cost:>26} {change:>28}")
        return "\n".join(lines)


def _interval(estimate: Mapping[str, float | None], digits: str) -> str:
    """A number with its interval, as far as they are known."""
    value, low, high = (estimate[key] for key in ("value", "low", "high"))
    if value is None:
        return "-"
    if low is None or high is None:
        return format(value, digits)
    return f"{value:{digits}} [{low:{digits}}, {high:{digits}}]"


def plan_many(
    cases: Sequence[Scenario],
    mission: Mission | None = None,
    *,
    integrator: Integrator = "rk4",
    mode: Mode = "optimal",
    initial_guess: Guess | None = None,
    deadline_s: float | None = None,
    jobs: int | None = None,
    keep: bool = False,
) -> Table:
    """Plans many approaches on several threads, by default as many as there are cores.

    Rows do not depend on the number of threads, but for their times.

    Parameters
    ----------
    cases : the scenarios, one at least.
    mission : what is planned for; None is the built-in mission.
    integrator : as of `plan`.
    mode : as of `plan`.
    initial_guess : as of `plan`; a function is called on the calling thread.
    deadline_s : time for each plan [s]; None is as long as it takes.
    jobs : threads; None is as many as there are cores.
    keep : whether the plans are kept, in `plans` of the table.

    Returns
    -------
    A dict of arrays, a row a scenario. A refused scenario is a row whose `reason` names the constraint.

    Raises
    ------
    ValueError : an argument that makes no sense.
    KeyboardInterrupt : Ctrl-C, within a second.
    """
    columns, rows, plans = _remora.plan_many(
        cases,
        mission,
        integrator=integrator,
        mode=mode,
        initial_guess=initial_guess,
        deadline_s=deadline_s,
        jobs=jobs,
        keep=keep,
    )
    return Table(columns, rows, plans)


def compare_guesses(
    guesses: Mapping[str, Guess],
    cases: Sequence[Scenario],
    mission: Mission | None = None,
    *,
    integrator: Integrator = "rk4",
    mode: Mode = "optimal",
    jobs: int | None = 1,
) -> Comparison:
    """Plans the same approaches from each guess, one guess after the other scenario by scenario.

    All are so measured under the same load; times are comparable with one job.

    Parameters
    ----------
    guesses : what Stage 2 starts from, by name; the others are compared with the first.
    cases : the scenarios, one at least.
    mission : what is planned for; None is the built-in mission.
    integrator : as of `plan`.
    mode : as of `plan`.
    jobs : threads; None is as many as there are cores.

    Returns
    -------
    By name, what a guess comes to and, in `against`, what changes; printed as a table.

    Raises
    ------
    ValueError : an argument that makes no sense.
    KeyboardInterrupt : Ctrl-C, within a second.
    """
    if not isinstance(guesses, Mapping):
        raise ValueError(f"guesses: expected a dict, found {guesses!r}")
    found = _remora.compare_guesses(dict(guesses), cases, mission, integrator=integrator, mode=mode, jobs=jobs)
    return Comparison(found)
