"""Campaigns: tables that do not depend on the number of threads."""

import csv
from pathlib import Path

import numpy as np

import remora


# Verifies REM-DOR-005.
def test_rows_do_not_depend_on_threads() -> None:
    cases = remora.draw(6, seed=3)
    one = remora.plan_many(cases, integrator="euler", jobs=1)
    two = remora.plan_many(cases, integrator="euler", jobs=2)
    assert list(one) == list(two)
    for name in one:
        if not name.endswith("time_s") and name != "inference_s":
            np.testing.assert_array_equal(one[name], two[name], err_msg=name)
    assert one["verified"].all() and one["verified"].dtype == np.bool_
    assert one["stage2_iterations"].dtype == np.int64
    assert one["stage2_cost"].dtype == np.float64
    assert list(one["scenario"]) == [case.id for case in cases]


def test_plans_are_kept_in_order() -> None:
    cases = remora.draw(4, seed=3)
    table = remora.plan_many(cases, integrator="euler", keep=True, jobs=2)
    for case, plan, checksum in zip(cases, table.plans, table["checksum"], strict=True):
        assert plan is not None and plan.scenario == case and plan.checksum == checksum
    assert remora.plan_many(cases[:1], integrator="euler").plans == []


def test_tables_are_written(here: Path) -> None:
    table = remora.plan_many(remora.draw(3, seed=3), integrator="euler", mode="feasible")
    table.to_parquet("a.parquet")
    assert (here / "a.parquet").read_bytes()[:4] == b"PAR1"
    table.to_csv("a.csv")
    with open(here / "a.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    # The file has the columns of `remora campaign`; the checksum is the table's alone.
    assert list(rows[0]) == [name for name in table if name != "checksum"]
    assert [float(row["stage2_cost"]) for row in rows] == list(table["stage2_cost"])
