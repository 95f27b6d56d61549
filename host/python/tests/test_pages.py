"""Every piece of Python in the pages that people read runs, top to bottom."""

import re
import tempfile
import webbrowser
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGES = ["host/python/README.md", "docs/guides/python.md", "README.md"]

#: A fenced block of Python.
FENCE = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def snippets(page: str) -> list[str]:
    return FENCE.findall((ROOT / page).read_text())


@pytest.mark.parametrize("page", PAGES)
def test_snippets_run(page: str, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One after the other, with the names that those before have made; no browser opens."""
    monkeypatch.setattr(webbrowser, "open", lambda address: True)
    monkeypatch.setattr(tempfile, "tempdir", str(here))
    found = snippets(page)
    assert found or page == "README.md", f"{page} shows no Python"
    names: dict[str, object] = {}
    (here / "checkout").symlink_to(ROOT)
    for number, code in enumerate(found, 1):
        exec(compile(code, f"{page}, block {number}", "exec"), names)
