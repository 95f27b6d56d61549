"""HTML that notebooks show."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from remora._remora import Flight, Mission, Plan, Scenario


def _text(value: object) -> str:
    """A value in a cell; numbers with six digits."""
    if isinstance(value, np.ndarray | list | tuple):
        return "[" + ", ".join(_text(inner) for inner in value) + "]"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_text(inner)}" for key, inner in value.items())
    return html.escape(f"{value:.6g}" if isinstance(value, float) else str(value))


def _table(title: str, rows: Iterable[Sequence[object]]) -> str:
    """A table with names in the first column."""
    lines = [f"<tr><th>{_text(row[0])}</th>{''.join(f'<td>{_text(of)}</td>' for of in row[1:])}</tr>" for row in rows]
    return f"<table><caption>{html.escape(title)}</caption>{''.join(lines)}</table>"


def plan(of: Plan) -> str:
    """The picture, and the main numbers below it."""
    rows: list[tuple[object, ...]] = [
        ("verdict", of.verdict),
        ("status", of.status),
        ("Stage 2 started from", of.start),
        ("integrator", of.integrator),
        ("iterations", of.iterations),
        ("costs", of.costs),
        ("clearances [m]", of.clearances),
        ("checksum", of.checksum),
    ]
    return f"<div>{of.svg()}</div>{_table(f'Plan {of.scenario.id}', rows)}"


def scenario(of: Scenario) -> str:
    """A scenario's numbers."""
    rows: list[tuple[object, ...]] = [
        ("position of the centre of mass, RTN [m]", of.position),
        ("velocity, RTN [m/s]", of.velocity),
        ("target's attitude, body to RTN, x y z w", of.target_attitude),
        ("target's rate, body axes [rad/s]", of.target_rate),
        ("duration [s]", "the mission's" if of.duration_s is None else of.duration_s),
        ("nodes", "the mission's" if of.nodes is None else of.nodes),
    ]
    return _table(f"Scenario {of.id}", rows)


def _values(value: Any, at: str) -> Iterable[tuple[object, ...]]:
    """Keys and values, sections flat."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _values(inner, f"{at}.{key}" if at else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for i, inner in enumerate(value):
            yield from _values(inner, f"{at}[{i}]")
    else:
        yield at, value


def mission(of: Mission) -> str:
    """A mission's values, folded."""
    table = _table(f"Mission {of.checksum}", _values(of.to_dict(), ""))
    summary = f"Mission {of.checksum}: {of.joints} joints, {of.nodes} nodes, {of.duration_s:g} s"
    return f"<details><summary>{summary}</summary>{table}</details>"


def _outcome(of: Flight) -> tuple[object, ...]:
    violations = ", ".join(of.violations) or "none"
    return (of.ending, 1e3 * of.miss_m, 1e3 * of.speed_m_s, of.angle_rad, violations)


_COLUMNS = ("run", "ending", "miss [mm]", "speed [mm/s]", "angle [rad]", "limits passed")


def flight(of: Flight) -> str:
    """The end of a flight."""
    return _table(f"Flight {of.run}", zip(_COLUMNS[1:], _outcome(of), strict=True))


def flights(of: Sequence[Flight]) -> str:
    """The ends of flights, a row each."""
    captured = sum(one.is_captured for one in of)
    rows = [_COLUMNS, *((one.run, *_outcome(one)) for one in of)]
    return _table(f"{captured} of {len(of)} flights captured", rows)
