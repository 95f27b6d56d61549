"""What the door for Python costs: run by hand on an idle machine, in the environment that `ci/python.sh` leaves.

    target/python/test/bin/python ci/python_speed.py [REMORA]

Prints what `remora.plan` takes beyond the planner's own time; where the program REMORA is given, the planner's
processor time in the wheel against the program's; what a second job gains; and the environment's steps a second.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import remora
from remora.gym import ApproachVectorEnv


def overhead(cases: list[remora.Scenario]) -> None:
    """Of one plan after the other: wall time against what each says of itself, and the process's processor time
    against the planner's, which another program on the machine does not change."""
    own, whole, began_cpu = [], [], time.process_time()
    for case in cases:
        began = time.perf_counter()
        plan = remora.plan(case)
        torques, checksum = plan.torques, plan.checksum
        whole.append(time.perf_counter() - began)
        own.append(plan.times_s[2])
        assert torques.shape == (59, 6) and len(checksum) == 16
    process = time.process_time() - began_cpu
    planner = remora.plan_many(cases, jobs=1)["cpu_time_s"].sum()
    beyond = np.array(whole) - np.array(own)
    print(f"plan: {1e3 * np.mean(own):.1f} ms of its own, {1e3 * np.median(beyond):.2f} ms beside it (median); "
          f"processor time {process / planner - 1:+.1%}")


def against(program: str, cases: list[remora.Scenario]) -> None:
    """Processor time a plan in the wheel and in the program, by turns, three times; the least of each counts."""
    wheel, other = [], []
    for _ in range(3):
        table = remora.plan_many(cases, jobs=1)
        wheel.append(table["cpu_time_s"])
        with tempfile.TemporaryDirectory() as folder:
            command = [program, "--quiet", "campaign", "--jobs", "1", "--write", "csv", "--out", f"{folder}/a"]
            subprocess.run(command, check=True)
            lines = Path(folder, "a/results.csv").read_text().splitlines()
        at = lines[0].split(",").index("cpu_time_s")
        other.append(np.array([float(line.split(",")[at]) for line in lines[1:]]))
    ours, theirs = np.min(wheel, axis=0).sum(), np.min(other, axis=0).sum()
    print(f"processor time of {len(cases)} plans: wheel {ours:.3f} s, program {theirs:.3f} s: {ours / theirs - 1:+.1%}")


def scaling(cases: list[remora.Scenario]) -> None:
    """Of `plan_many`, one job and two by turns: wall time, and what two cost more in processor time."""
    wall: dict[int, list[float]] = {1: [], 2: []}
    work: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(3):
        for jobs in (1, 2):
            began, began_cpu = time.perf_counter(), time.process_time()
            remora.plan_many(cases, jobs=jobs)
            wall[jobs].append(time.perf_counter() - began)
            work[jobs].append(time.process_time() - began_cpu)
    one, two = min(wall[1]), min(wall[2])
    print(f"plan_many of {len(cases)}: {one:.2f} s with one job, {two:.2f} s with two: {one / two:.2f} times; "
          f"processor time {min(work[2]) / min(work[1]) - 1:+.1%}")


def steps(cases: list[remora.Scenario]) -> None:
    """Of the vectorised environment, actions drawn beforehand."""
    for count in (64, 256):
        envs = ApproachVectorEnv(count, cases[:8], jobs=2)
        envs.reset(seed=1)
        actions = np.random.default_rng(1).uniform(-0.2, 0.2, (60, count, 6)).astype(np.float32)
        best = 0.0
        for _ in range(5):
            began = time.perf_counter()
            for action in actions:
                envs.step(action)
            best = max(best, len(actions) * count / (time.perf_counter() - began))
        print(f"environment: {best:,.0f} steps/s, {count} at once, two jobs")


def main() -> None:
    cases = remora.scenarios()
    remora.plan(cases[0])
    overhead(cases)
    if len(sys.argv) > 1:
        against(sys.argv[1], cases)
    scaling(cases)
    steps(cases)


if __name__ == "__main__":
    main()
