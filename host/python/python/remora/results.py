"""Many plans: a table of them, and guesses against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

from numpy.typing import NDArray

from remora import _remora
from remora._remora import Mission, Plan, Scenario
from remora.guess import Guess


class Table(dict[str, NDArray[Any]]):
    """Columns of a campaign, an array each, a row a scenario: `docs/formats.md` tells what they are.

    `plans` holds the plans, None for a scenario that was refused, where they were asked for.
    """

    plans: list[Plan | None]

    def __init__(self, columns: Mapping[str, NDArray[Any]], rows: _remora.Rows, plans: list[Plan | None]) -> None:
        super().__init__(columns)
        self._rows = rows
        self.plans = plans

    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Writes the table as `remora campaign` does, units in its metadata."""
        self._rows.to_parquet(path)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Writes the table with a header line; numbers read back bit for bit."""
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
    integrator: str = "rk4",
    mode: str = "optimal",
    initial_guess: Guess | None = None,
    deadline_s: float | None = None,
    jobs: int | None = None,
    keep: bool = False,
) -> Table:
    """Plans many approaches on several threads, by default as many as there are cores.

    Rows do not depend on the number of threads, but for their times. `keep` keeps the plans.
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
    integrator: str = "rk4",
    mode: str = "optimal",
    jobs: int | None = 1,
) -> Comparison:
    """Plans the same approaches from each guess, one guess after the other scenario by scenario.

    All are so measured under the same load; times are comparable with one job.
    """
    found = _remora.compare_guesses(dict(guesses), cases, mission, integrator=integrator, mode=mode, jobs=jobs)
    return Comparison(found)
