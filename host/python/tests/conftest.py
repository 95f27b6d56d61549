"""What tests share: the checkout, a plan that many look at, a scratch folder to work in."""

from pathlib import Path

import pytest

import remora

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def case() -> remora.Scenario:
    """The first public scenario."""
    return remora.scenarios()[0]


@pytest.fixture(scope="session")
def plan(case: remora.Scenario) -> remora.Plan:
    """Its plan as everything defaults."""
    return remora.plan(case)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
