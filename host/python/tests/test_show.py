"""The page of a plan."""

import json
import re
import sys
import webbrowser
from pathlib import Path
from types import ModuleType, SimpleNamespace
from urllib.parse import unquote, urlparse

import pytest

import remora


def shown(page: str) -> dict:
    """What stands in a page."""
    return json.loads(re.search(r'id="remora-data">(.*?)</script>', page, re.DOTALL)[1])


def test_a_page_has_plan_and_flights(plan: remora.Plan, here: Path) -> None:
    flights = remora.fly(plan, errors="typical", seed=3, runs=2)
    page = plan.page("a.html", flights=flights)
    assert Path("a.html").read_text() == page
    data = shown(page)
    assert data["plans"][0]["file"]["scenario"] == plan.scenario.id
    assert data["plans"][0]["file"]["stage2"]["joint_angle_rad"] == plan.joint_angle.tolist()
    assert [flight["plan"] for flight in data["flights"]] == [0, 0]
    assert len(data["flights"][0]["rows"]["time_s"]) > 500
    assert shown(plan.page())["flights"] == []
    # It loads nothing.
    assert "http://" not in page.replace("http://www.w3.org/", "") and "https://" not in page


def test_show_opens_a_browser(plan: remora.Plan, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or True)
    plan.show()
    file = Path(unquote(urlparse(opened[0]).path))
    assert file.read_text() == plan.page() and capsys.readouterr().out == ""
    file.unlink()

    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    plan.show()
    address = re.search(r"open (file://\S+)", capsys.readouterr().out)[1]
    Path(unquote(urlparse(address).path)).unlink()


def test_show_displays_in_a_notebook(plan: remora.Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    displayed = []
    notebook, display = ModuleType("IPython"), ModuleType("IPython.display")
    notebook.get_ipython = lambda: SimpleNamespace(kernel=object())
    display.HTML, display.display = str, displayed.append
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    flight = remora.fly(plan)
    plan.show(flights=[flight])
    assert displayed[0].startswith("<iframe srcdoc=") and "&quot;remora-data&quot;" in displayed[0]
