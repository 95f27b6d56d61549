"""Ctrl-C: every call that can run longer than a second answers within one."""

import inspect
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import remora
import remora.gym

#: Code of a child process before it is ready.
SETUP = """
import time
import numpy as np
import remora, remora.gym
from remora._remora import Episodes
case = remora.scenarios()[0]
def long_plan(): return remora.Plan.load("long.plan.json")
def many(count, cases): return Episodes(cases, None, count=count, integrator="rk4", encoding="body",
                                        miss_weight=1.0, jobs=None)
def busy(scene):
    while True: pass
"""

#: Calls that run longer than a second, by entry: the code before them, and the call. Calls that end sooner on
#: every input are repeated.
LONG = {
    "draw": [("", "remora.draw(10**6)")],
    "scenarios": [("", "while True: remora.scenarios()")],
    "plan": [
        ("", "remora.plan(case, integrator='rk4:1000')"),
        ("", "remora.plan(case, integrator='rk4:1000', initial_guess='heuristic', deadline_s=600.0)"),
        ("", "remora.plan(case, initial_guess=lambda scene: time.sleep(60))"),
        ("", "remora.plan(case, initial_guess=busy)"),
    ],
    "plan_many": [
        ("", "remora.plan_many([case] * 4, integrator='rk4:1000')"),
        ("", "remora.plan_many(remora.scenarios() * 100, jobs=2, keep=True)"),
        ("", "remora.plan_many([case] * 4, initial_guess=lambda scene: time.sleep(60), jobs=2)"),
    ],
    "compare_guesses": [("", "remora.compare_guesses({'h': 'heuristic'}, [case] * 4, integrator='rk4:1000')")],
    "subproblem": [("plan = long_plan()", "remora.subproblem(plan, 1)")],
    "fly": [
        ("plan = remora.plan(case)", "remora.fly(plan, errors='typical', runs=400)"),
        ("plan = long_plan()", "remora.fly(plan, errors='typical', controller='replan')"),
        ("plan = long_plan()", "remora.fly(plan, errors='typical', controller='replan', runs=3)"),
    ],
    "Mission.from_urdf": [("", "while True: remora.Mission.from_urdf('spatial.urdf', tip='tip')")],
    "Plan.load": [("", "while True: long_plan()")],
    "Plan.page": [("plan = remora.plan(case); flights = remora.fly(plan, runs=1) * 100",
                   "while True: plan.page(flights=flights)")],
    "Plan.show": [("plan = remora.plan(case); flights = remora.fly(plan, runs=1) * 100; import webbrowser;"
                   "webbrowser.open = lambda address: True", "while True: plan.show(flights=flights)")],
    "Scene.rollout": [("", "remora.plan(case, integrator='rk4:1000', initial_guess=lambda scene: "
                           "[scene.rollout(np.zeros((59, 6))) for _ in range(1000)])")],
    "gym.ApproachEnv": [("", "remora.gym.ApproachEnv(remora.scenarios() * 200)")],
    "gym.ApproachVectorEnv": [
        ("", "remora.gym.ApproachVectorEnv(4, remora.scenarios() * 200)"),
        ("all = many(300_000, [case]); actions = np.zeros((300_000, 6), np.float32)", "while True: all.step(actions)"),
        ("all = many(300_000, [case])", "while True: all.observe()"),
    ],
}

#: Entries that take milliseconds on every input.
SHORT = {
    "Comparison",
    "Flight",
    "Flights",
    "Mission.default",
    "Mission.from_dict",
    "Mission.from_toml",
    "Mission.replace",
    "Mission.to_dict",
    "Mission.to_toml",
    "Model",
    "Plan.save",
    "Plan.svg",
    "Refused",
    "Scenario",
    "Scene.features",
    "Scene.miss",
    "Scene.step",
    "Subproblem.save",
    "Table",
    "Table.to_csv",
    "Table.to_parquet",
}

#: Classes that only the module makes.
MADE = {"Mission", "Plan", "Scene", "Subproblem"}


def entries() -> set[str]:
    """Everything that a caller may call."""
    found = {"gym.ApproachEnv", "gym.ApproachVectorEnv"}
    for name in remora.__all__:
        of = getattr(remora, name)
        if inspect.isclass(of):
            own = [method for method, value in vars(of).items() if callable(value) or isinstance(value, staticmethod)]
            found |= {f"{name}.{method}" for method in own if not method.startswith("_")}
            found |= {name} - MADE
        elif callable(of) and name != "Guess":
            found.add(name)
    return found


def test_every_entry_is_known_to_be_long_or_short() -> None:
    assert entries() == LONG.keys() | SHORT


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Path:
    """A folder with a plan whose verification, subproblems and replans take long, and an arm."""
    folder = tmp_path_factory.mktemp("long")
    remora.plan(remora.scenarios()[0], integrator="rk4:1000").save(folder / "long.plan.json")
    (folder / "spatial.urdf").symlink_to(root / "fixtures/urdf/spatial.urdf")
    return folder


CALLS = [(name, *call) for name, calls in LONG.items() for call in calls]


def test_ctrl_c_ends_a_plan(tmp_path: Path) -> None:
    look("plan", *LONG["plan"][0], tmp_path)


# Three seconds each, on a quiet machine.
@pytest.mark.slow
@pytest.mark.parametrize(("entry", "before", "call"), CALLS, ids=lambda value: None)
def test_ctrl_c_is_answered_within_a_second(entry: str, before: str, call: str, folder: Path) -> None:
    look(entry, before, call, folder)


def look(entry: str, before: str, call: str, folder: Path) -> None:
    """Interrupts a call in a process of its own, which must answer within a second and do no more work."""
    text = f"""{SETUP}
{before}
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", time.monotonic(), flush=True)
time.sleep(1.0)
busy = time.process_time()
time.sleep(0.5)
print(time.process_time() - busy, flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", text], cwd=folder, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None and child.stdout.readline() == "ready\n"
        time.sleep(1.0)
        sent = time.monotonic()
        child.send_signal(signal.SIGINT)
        said = child.stdout.readline().split()
        rest = child.stdout.readline()
    assert said and said[0] == "interrupted", f"{entry}: {call} ended before the signal"
    assert float(said[1]) - sent < 1.0, f"{entry}: {call}"
    # No work goes on after the interrupt.
    assert float(rest) < 0.25, f"{entry}: {call}"
    assert child.returncode == 0
