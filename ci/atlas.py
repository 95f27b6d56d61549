#!/usr/bin/env python3
"""The atlas's page and pictures, made of its parts: what `ci/atlas.sh` calls.

    ci/atlas.py hard WORK              indices of the hardest plans and of those that failed, with commas
    ci/atlas.py page WORK --out DIR    DIR/atlas.md, DIR/pictures/atlas-*.webp
"""

import argparse
import json
from pathlib import Path

import duckdb
import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

#: One in so many plans is among the hardest.
HARDEST = 10_000
#: Fewest and most of them that are looked at again.
FEWEST, MOST = 10, 200
#: Most cells of the maps along each axis, plans that a cell should have, and the fewest that make one.
CELLS, WANTED, LEAST = 40, 30, 3

#: What is mapped: name, expression, statistic of a cell, unit, logarithmic.
MAPS = [
    ("cost of attitude and arm, median", "stage2_cost", "median", "1", True),
    ("iterations of Stage 2, mean", "stage2_iterations", "mean", "1", False),
    ("processor time of a plan, median", "1e3 * cpu_time_s", "median", "ms", True),
    ("smallest distance of bodies, lowest 1 %", "1e3 * clearance_smallest_m", "low", "mm", False),
    ("change of velocity, mean", "1e3 * delta_v_m_s", "mean", "mm/s", False),
    ("iterations of Stage 2, most", "stage2_iterations", "most", "1", False),
]

STATISTICS = {
    "mean": "avg({0})",
    "median": "median({0})",
    "most": "max({0})",
    "low": "quantile_cont({0}, 0.01)",
}

#: What a plan that cannot be flown fails by, in words.
REASONS = {
    "dynamics1": "the path of the centre of mass is not what its forces make of it",
    "dynamics2": "attitude and arm are not what torques make of them: the loop ended at its limit of iterations",
    "keep_out": "the path passes the keep-out ellipsoid",
    "control": "a force or torque passes its limit",
    "joint": "a joint passes its stop",
    "joint_rate": "a joint turns faster than its limit",
    "pointing": "the port leaves the field of view",
    "preset": "the arm is not in its capture configuration from the preset node on",
    "terminal_rate": "bus and target turn at different rates at capture",
    "ee_position": "the end effector misses the port",
    "ee_angle": "the end effector comes at an angle",
    "clearance": "bodies come too near to each other",
    "force": "refused before planning: no force within the limit gets there in time",
    "capture_view": "refused before planning: the port is out of view at capture",
}


def parts(work):
    """A connection to which the parts are one table."""
    connection = duckdb.connect()
    connection.execute("set memory_limit = '1GB'")
    glob = str(work / "part-*.parquet").replace("'", "''")
    connection.execute(f"create view atlas as select * from '{glob}'")
    return connection


def hardest(connection):
    """Ids of the plans that took the most iterations, then cost most; then of all that are not optimal."""
    count = connection.execute("select count(*) from atlas").fetchone()[0]
    most = min(max(count // HARDEST, FEWEST), MOST)
    hard = connection.execute(
        "select scenario from atlas where verdict = 'optimal' "
        f"order by stage2_iterations desc, stage2_cost desc, scenario limit {most}"
    ).fetchall()
    failed = connection.execute(
        f"select scenario from atlas where verdict <> 'optimal' order by scenario limit {MOST}"
    ).fetchall()
    return [row[0] for row in hard], [row[0] for row in failed]


def maps(connection, folder):
    """A picture of maps over tumble rate and distance at the start; its name."""
    figure, panels = plt.subplots(2, 3, figsize=(15, 8.5), layout="constrained")
    count, low, high, near, far = connection.execute(
        "select count(*), 1e3 * min(target_rate_rad_s), 1e3 * max(target_rate_rad_s), min(start_distance_m), "
        "max(start_distance_m) from atlas"
    ).fetchone()
    cells = max(3, min(CELLS, int((count / WANTED) ** 0.5)))
    rates, distances = np.linspace(low, high, cells + 1), np.linspace(near, far, cells + 1)
    for panel, (title, what, statistic, unit, is_log) in zip(panels.flat, MAPS, strict=True):
        value = STATISTICS[statistic].format(what)
        found = connection.execute(
            f"select least({cells - 1}, floor((1e3 * target_rate_rad_s - {low}) / {high - low} * {cells}))::int, "
            f"least({cells - 1}, floor((start_distance_m - {near}) / {far - near} * {cells}))::int, {value} "
            f"from atlas where verified group by 1, 2 having count(*) >= {LEAST}"
        ).fetchall()
        grid = np.full((cells, cells), np.nan)
        for i, j, x in found:
            grid[j, i] = x
        image = panel.pcolormesh(rates, distances, grid, norm="log" if is_log else "linear", cmap="viridis")
        figure.colorbar(image, ax=panel, label=f"[{unit}]")
        panel.set(title=title, xlabel="tumble rate [mrad/s]", ylabel="distance at the start [m]")
    return save(figure, folder, "atlas-maps")


def tails(connection, folder):
    """A picture of how often a plan takes more than so many iterations, so long, so much; its name."""
    figure, panels = plt.subplots(1, 3, figsize=(15, 4.2), layout="constrained")
    for panel, (what, label) in zip(
        panels,
        [
            ("stage2_iterations", "iterations of Stage 2"),
            ("1e3 * cpu_time_s", "processor time of a plan [ms]"),
            ("stage2_cost", "cost of attitude and arm"),
        ],
        strict=True,
    ):
        values = np.sort(connection.execute(f"select {what} as x from atlas where verified").fetchnumpy()["x"])
        panel.step(values, 1.0 - np.arange(len(values)) / len(values), where="post")
        panel.set(xlabel=label, ylabel="share of plans with as much or more", xscale="log", yscale="log")
        panel.grid(alpha=0.3)
    return save(figure, folder, "atlas-tails")


def save(figure, folder, name):
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / f"{name}.webp", dpi=110, pil_kwargs={"quality": 80, "method": 6})
    plt.close(figure)
    return f"pictures/{name}.webp"


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def spreads(connection):
    """Mean and percentiles of what is measured."""
    rows = []
    for name, what in [
        ("iterations of Stage 1", "stage1_iterations"),
        ("iterations of Stage 2", "stage2_iterations"),
        ("cost of attitude and arm", "stage2_cost"),
        ("processor time [ms]", "1e3 * cpu_time_s"),
        ("change of velocity [mm/s]", "1e3 * delta_v_m_s"),
        ("smallest distance of bodies [mm]", "1e3 * clearance_smallest_m"),
    ]:
        quantiles = ", ".join(f"quantile_cont({what}, {q})" for q in (0.0001, 0.5, 0.99, 0.9999))
        row = connection.execute(
            f"select min({what}), {quantiles}, max({what}), avg({what}) from atlas where verified"
        ).fetchone()
        rows.append([name, *(f"{x:.4g}" for x in row)])
    return table(["verified plans", "least", "0.01 %", "median", "99 %", "99.99 %", "most", "mean"], rows)


def again(work):
    """What the hard scenarios come to from the heuristic start, by id."""
    file = str(work / "again" / "results.parquet").replace("'", "''")
    rows = duckdb.execute(f"select scenario, verdict, stage2_iterations from '{file}'").fetchall()
    return {scenario: f"{verdict}, {iterations}" for scenario, verdict, iterations in rows}


def listed(connection, ids, second):
    """A table of scenarios."""
    words = ", ".join(f"'{one}'" for one in ids)
    rows = connection.execute(
        "select scenario, stage2_iterations, stage2_cost, 1e3 * cpu_time_s, 1e3 * target_rate_rad_s, "
        f"start_distance_m from atlas where scenario in ({words}) order by stage2_iterations desc, stage2_cost desc"
    ).fetchall()
    return table(
        ["scenario", "iterations", "cost", "time [ms]", "tumble [mrad/s]", "distance [m]", "from the heuristic"],
        [[s, n, f"{c:.4g}", f"{t:.0f}", f"{r:.3f}", f"{d:.2f}", second.get(s, "")] for s, n, c, t, r, d in rows],
    )


def alike(connection, ids):
    """How the hardest differ from all, in medians."""
    words = ", ".join(f"'{one}'" for one in ids)
    rows = []
    for name, what in [
        ("tumble rate [mrad/s]", "1e3 * target_rate_rad_s"),
        ("distance at the start [m]", "start_distance_m"),
        ("largest bus torque [N m]", "peak_bus_torque_n_m"),
        ("largest force [N]", "peak_force_n"),
        ("cost of attitude and arm", "stage2_cost"),
    ]:
        all_, hard = connection.execute(
            f"select median({what}), median({what}) filter (scenario in ({words})) from atlas where verified"
        ).fetchone()
        rows.append([name, f"{all_:.4g}", f"{hard:.4g}"])
    return table(["median", "all", "the hardest"], rows)


def by_cost(connection):
    """Iterations of Stage 2 over what attitude and arm cost, in steps of a factor of two."""
    rows = connection.execute(
        "select floor(log2(stage2_cost))::int as step, count(*), avg(stage2_iterations), max(stage2_iterations), "
        "100 * avg((stage2_iterations > 20)::int) from atlas where verified group by 1 order by 1"
    ).fetchall()
    return table(
        ["cost of attitude and arm", "plans", "iterations, mean", "most", "of more than 20 [%]"],
        [[f"{2.0**s:.3g} to {2.0 ** (s + 1):.3g}", f"{n:,}", f"{m:.2f}", k, f"{p:.2g}"] for s, n, m, k, p in rows],
    )


def failures(connection, second):
    """Every plan that is not optimal, by what it fails by."""
    text = []
    groups = connection.execute(
        "select verdict, reason, status, count(*), list(scenario order by scenario) from atlas "
        "where verdict <> 'optimal' group by 1, 2, 3 order by 4 desc"
    ).fetchall()
    for verdict, reason, status, count, ids in groups:
        why = REASONS.get(reason, "verified, and ended before it had converged" if not reason else reason)
        solved = sum(second.get(one, "").startswith("optimal") for one in ids)
        text.append(
            f"**{count} {verdict.replace('_', ' ')}, {status}{f', by `{reason}`' if reason else ''}**: {why}. "
            f"From the heuristic start {solved} of the {min(count, len(second))} that were planned again are optimal.\n"
        )
        text.append(listed(connection, ids[:20], second) + "\n")
    return "\n".join(text) if text else "None: every plan is optimal.\n"


def wrapped(text, width=120):
    """Paragraphs in lines of the pages' width; tables stay."""
    import textwrap

    blocks = text.split("\n\n")
    is_prose = [not block.lstrip().startswith(("|", "#", "!", "```")) for block in blocks]
    fill = [textwrap.fill(b, width, break_long_words=False) if p else b for b, p in zip(blocks, is_prose, strict=True)]
    return "\n\n".join(fill)


def page(work, out):
    connection = parts(work)
    gathered = json.loads((work / "gathered.json").read_text())
    first = str(next(iter(sorted(work.glob("part-*.parquet"))))).replace("'", "''")
    said = dict(duckdb.execute(f"select decode(key), decode(value) from parquet_kv_metadata('{first}')").fetchall())
    hard, _ = hardest(connection)
    second = again(work)
    summary = gathered["summary"]
    count, optimal = summary["scenarios"], summary["by_verdict"]["optimal"]
    verified = optimal + summary["by_verdict"]["verified_not_converged"]
    pictures = out / "pictures"
    hours = connection.execute("select sum(cpu_time_s) / 3600 from atlas").fetchone()[0]
    text = f"""# Atlas: {count:,} plans

![Maps over tumble rate and distance at the start: cost, iterations, time, clearance, change of velocity]({maps(connection, pictures)})

{count:,} drawn approaches (seed {said["remora.seed"]}), planned in Euler's discretisation from the learned start by
commit {said["remora.commit"]}: {optimal:,} optimal ({100 * optimal / count:.4f} %), {verified:,} verified
({100 * verified / count:.4f} %). {hours:.2f} hours of processor time. This page and its pictures are made by
`ci/atlas.sh`; the same seed and commit give the same plans, whose checksum is `{gathered["checksum"]}` over all columns
but times. {gathered["recomputed"]:,} of them were planned again: {len(gathered["differences"])} differ.

## How they are spread

{spreads(connection)}

![Shares of plans with as many iterations, as much time and cost or more]({tails(connection, pictures)})

In Euler's discretisation nothing asks bodies to stay apart (`docs/concepts/problem.md`): distances below zero are
overlaps, told by the verifier and no failure. Times are of parts that shared the machine with each other: they serve to compare, not to promise.

## What makes a plan hard

Iterations follow the cost, as the table shows. Tumble rate and distance at the start change cost, time and distances
of bodies, and hardly the iterations (the maps).

{by_cost(connection)}

## The hardest

The {len(hard)} optimal plans of most iterations. The last column is what the same scenario comes to from the heuristic
start: verdict and iterations.

{alike(connection, hard)}

{listed(connection, hard[:30], second)}

## What failed

{failures(connection, second)}"""
    (out / "atlas.md").write_text(wrapped(text).rstrip() + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["hard", "page"])
    parser.add_argument("work", type=Path)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    if arguments.what == "hard":
        both = hardest(parts(arguments.work))
        print(",".join(sorted({one.split("-")[1].lstrip("0") or "0" for ids in both for one in ids})))
    else:
        page(arguments.work, arguments.out or arguments.work)


if __name__ == "__main__":
    main()
