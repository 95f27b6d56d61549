"""Stubs and module agree, and what is written in Python is typed."""

import inspect
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import remora


def test_stubs_are_those_of_the_module(tmp_path: Path) -> None:
    found = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "remora", "--concise"],
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
