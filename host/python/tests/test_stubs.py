"""Stubs and module agree, and what is written in Python is typed."""

import inspect
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import remora


def test_stubs_are_those_of_the_module(tmp_path: Path) -> None:
    # A compiled class has it without listing it; unions of literals exist for mypy only.
    (tmp_path / "allowed").write_text("remora\\._remora\\.Mission\\.__getattr__\nremora\\.names\\..*\n")
    found = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "remora", "--concise", "--allowlist", "allowed"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert found.returncode == 0, found.stdout + found.stderr


def test_the_package_is_typed(root: Path, tmp_path: Path) -> None:
    assert (files(remora) / "py.typed").is_file()
    command = [sys.executable, "-m", "mypy", "--strict", "-p", "remora"]
    found = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr


def test_what_is_public_has_its_documentation() -> None:
    for name in remora.__all__:
        of = getattr(remora, name)
        if inspect.isclass(of) or inspect.isroutine(of):
            assert of.__doc__, name


def test_help_tells_parameters_results_and_exceptions() -> None:
    """Docstrings of everything callable name each parameter, the result and the exceptions."""
    missing = []
    for name in remora.__all__:
        of = getattr(remora, name)
        if inspect.isclass(of):
            own = [key for key, value in vars(of).items() if callable(value) or isinstance(value, staticmethod)]
            entries = {f"{name}.{key}": getattr(of, key) for key in own if not key.startswith("_")}
            if name in ("Model", "Scenario"):
                entries[name] = of
        else:
            entries = {name: of} if inspect.isroutine(of) else {}
        for entry, call in entries.items():
            signature, text = inspect.signature(call), inspect.getdoc(call) or ""
            names = [key for key in signature.parameters if key != "self"]
            wanted = [f"{key} : " for key in names] + (["Raises\n"] if names else ["Returns\n"])
            if entry in ("plan", "fly", "draw", "plan_many", "Mission.replace", "Plan.load", "Plan.page"):
                wanted.append("Returns\n")
            missing += [f"{entry}: {word.strip()}" for word in wanted if word not in text]
    assert missing == []
