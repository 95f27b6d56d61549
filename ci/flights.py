#!/usr/bin/env python3
"""Flies every class of errors of docs/guides/simulate.md and prints its table.

    ci/flights.py runs/flights                    # all classes; goes on where it was stopped
    ci/flights.py runs/flights none typical       # two of them
    JOBS=1 REMORA=remora ci/flights.py runs/flights

Plans of drawn scenarios (seed 1), from the learned start. Each class gets a folder with its CLASS.errors.toml beside
it, made of what `remora mission errors` prints of `none` and `typical`. Needs the program built (`cargo build
--release`).
Exit status: 0, whatever became of the flights; 2 where the program refuses.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

REMORA = os.environ.get("REMORA", str(Path(__file__).resolve().parent.parent / "target/release/remora"))
AT_ANY_TIME = "\n[faults]\ndrawn_within_s = 1200.0\n"
REPLAN = ["--controller", "replan:100"]


def printed(which):
    return subprocess.run([REMORA, "mission", "errors", which], check=True, stdout=subprocess.PIPE, text=True).stdout


def with_typical(*sections):
    """No errors but the typical ones of these sections."""
    typical, section = iter(printed("typical").splitlines()), ""
    lines = []
    for line in printed("none").splitlines():
        other = next(typical)
        section = line.strip("[]") if line.startswith("[") else section
        lines.append(other if section in sections else line)
    return "\n".join(lines) + "\n"


def changed(text, section, change):
    """Typical errors with the values of a section, and of its subsections, changed: key, value to value."""
    inside, lines = False, []
    for line in text.splitlines():
        if line.startswith("["):
            inside = line.strip("[]").split(".")[0] == section
        elif inside and " = " in line:
            key, value = line.split(" = ")
            line = f"{key} = {change(key, float(value))!r}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def typical(faults="\n[faults]\n"):
    return printed("typical").replace("\n[faults]\n", faults)


def twice(key, value):
    return value if key.endswith(("_time_s", "_range_m")) else 2 * value


def late(key, value):
    return 0.5 if key == "delay_s" else value


def fast_tumble(key, value):
    return {"rate": 0.1, "rate_direction_rad": 0.17453292519943295}.get(key, value)


# Class: what the table calls it; scenarios; runs of each; errors; flags of `remora fly`.
CLASSES = {
    "none": ("none", 100, 1, lambda: printed("none"), []),
    "thrusters": ("thrusters", 100, 1, lambda: with_typical("thrusters"), []),
    "actuators": ("wheels and joints", 100, 1, lambda: with_typical("wheels", "joints"), []),
    "mass": ("mass", 100, 1, lambda: with_typical("mass"), []),
    "orbit": ("orbit", 100, 1, lambda: with_typical("orbit"), []),
    "tumble": ("tumble", 100, 1, lambda: with_typical("tumble"), []),
    "navigation": ("navigation", 100, 1, lambda: with_typical("navigation"), []),
    "geometry": ("geometry", 100, 1, lambda: with_typical("geometry"), []),
    "typical": ("all typical, 300 scenarios, four draws each", 300, 4, typical, []),
    "blind": ("... without the wrist camera", 300, 1, typical, ["--camera", "0"]),
    "navigation2": (
        "... navigation twice as bad", 100, 1, lambda: changed(typical(), "navigation", twice), []),
    "delay": ("... 0.5 s of delay", 100, 1, lambda: changed(typical(), "sensors", late), []),
    "slow": ("... guidance at 1 Hz", 100, 1, typical, ["--guidance-rate", "1"]),
    "servos": ("... joints with servos", 100, 1, typical, ["--joints", "servo"]),
    "tumble10": ("... tumble 10 %, 10 deg", 100, 1, lambda: changed(typical(), "tumble", fast_tumble), []),
    "tumble10-replan": (
        "... the same, planned again every 100 s", 100, 1, lambda: changed(typical(), "tumble", fast_tumble), REPLAN),
    "rate": (
        "... target's rate 20 % higher from 600 s on", 300, 1,
        lambda: typical("\n[faults.target_rate]\nfactor = 1.2\ntime_s = 600.0\n"), []),
} | {
    f"lost-{axis}": (
        f"... thruster axis {axis} lost at a random time", 300, 1,
        lambda axis=axis: typical(f"{AT_ANY_TIME}\n[faults.thruster_lost]\naxis = {axis}\ntime_s = 0.0\n"), [])
    for axis in range(3)
} | {
    f"stuck-{joint}": (
        f"... joint {joint + 1} stuck at a random time", 300, 1,
        lambda joint=joint: typical(f"{AT_ANY_TIME}\n[faults.joint_stuck]\njoint = {joint}\ntime_s = 0.0\n"), [])
    for joint in range(3)
}


def fly(folder, name):
    _, count, runs, errors, flags = CLASSES[name]
    file = folder / f"{name}.errors.toml"
    file.write_text(errors())
    out, draw = str(folder / name), ["--count", str(count), "--seed", "1"]
    plan = [REMORA, "--quiet", "campaign", *draw, "--write", "plans", "--out", out]
    flight = [REMORA, "--quiet", "fly", out, "--runs", str(runs), "--seed", "1", "--errors", str(file), "--out", out]
    jobs = ["--jobs", os.environ["JOBS"]] if "JOBS" in os.environ else []
    for command in [plan + jobs, flight + flags + jobs]:
        if subprocess.run(command).returncode == 2:
            sys.exit(2)
    return json.loads((folder / name / "flights.summary.json").read_text())


def row(name, summary):
    endings = {ending: share["count"] for ending, share in summary["endings"] if share["count"]}
    spreads = {spread["name"]: spread for spread in summary["spreads"]}
    miss, angle, speed = (spreads[key] for key in ("miss_m", "angle_deg", "speed_m_s"))
    cells = [CLASSES[name][0], str(summary["runs"]), ", ".join(f"{n} {ending}" for ending, n in endings.items())]
    # One that was aborted ends far from the port, whatever that says.
    if "aborted" in endings:
        cells += ["", "", ""]
    else:
        cells.append(", ".join(f"{1e3 * miss[key]:.2f}" for key in ("mean", "p95", "worst")))
        cells += [f"{angle['p95']:.3f}", f"{1e3 * speed['p95']:.3f}"]
    cells.append(f"{spreads['joint_rate_over_limit']['worst']:.2f}")
    made, verified = summary["replans"]
    cells.append(f"{verified} of {made}" if made else "")
    cells.append(", ".join(f"{count} {limit}" for limit, count in summary["violations"]))
    return "| " + " | ".join(cells) + " |"


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    folder, names = Path(sys.argv[1]), sys.argv[2:] or list(CLASSES)
    if unknown := [name for name in names if name not in CLASSES]:
        print(f"error: {unknown[0]}: is no class; there are {', '.join(CLASSES)}", file=sys.stderr)
        sys.exit(2)
    folder.mkdir(parents=True, exist_ok=True)
    print("| errors | runs | endings | miss [mm]: mean, 95 %, worst | angle, 95 % [deg] | speed, 95 % [mm/s] "
          "| joint rate over limit, worst | plans in flight verified | violations |")
    print("| --- | ---: | --- | --- | ---: | ---: | ---: | --- | --- |")
    for name in names:
        print(row(name, fly(folder, name)), flush=True)


if __name__ == "__main__":
    main()
