"""Missions as dicts, with the keys of mission files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from remora import _remora


class Section(dict[str, Any]):
    """A part of a mission. Its keys are attributes too; changing it changes no mission."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"a mission's section has no {name!r}; it has {', '.join(self)}") from None


def _sections(value: Any) -> Any:
    """The value with attributes for its keys."""
    if isinstance(value, dict):
        return Section({key: _sections(inner) for key, inner in value.items()})
    return [_sections(inner) for inner in value] if isinstance(value, list) else value


def section(values: dict[str, Any], name: str) -> Any:
    """A top-level value of a mission; None if an optional key is left out."""
    if name not in values and name not in ("roll", "typical"):
        raise AttributeError(f"'remora.Mission' object has no attribute {name!r}")
    return _sections(values.get(name))


def names(of: type, values: dict[str, Any]) -> list[str]:
    """Names of a mission's attributes."""
    return sorted({*dir(of), *values, "roll", "typical"})


def merged(values: Mapping[str, Any], changes: Mapping[str, Any] | None) -> dict[str, Any]:
    """Values with changes; in a section, keys that are not named stay."""
    out = dict(values)
    for key, change in (changes or {}).items():
        old = out.get(key)
        if isinstance(old, Mapping) and isinstance(change, Mapping):
            change = merged(old, change)
        out[key] = change
    return out


def _not_finite(value: Any, at: str) -> Iterator[str]:
    """Paths of numbers that are not finite, which JSON cannot hold."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _not_finite(inner, f"{at}.{key}" if at else str(key))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _not_finite(inner, f"{at}[{i}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield at


def _plain(value: Any, at: str) -> Any:
    """A value as JSON has it; numpy's arrays and numbers are taken."""
    if isinstance(value, Mapping):
        # None is left out, as in a file.
        given = {str(key): inner for key, inner in value.items() if inner is not None}
        return {key: _plain(inner, f"{at}.{key}" if at else key) for key, inner in given.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(inner, f"{at}[{i}]") for i, inner in enumerate(value)]
    if isinstance(value, str | int | float):
        return value
    raise ValueError(f"mission: {at}: {type(value).__name__} cannot be a value of a mission")


def to_json(values: object) -> str:
    """A mission's values as JSON."""
    if not isinstance(values, Mapping):
        raise ValueError(f"values: expected a dict, found {values!r}")
    plain = _plain({"format": _remora.Mission.default().to_dict()["format"], **values}, "")
    for at in _not_finite(plain, ""):
        raise ValueError(f"mission: {at}: is not finite")
    return json.dumps(plain)
