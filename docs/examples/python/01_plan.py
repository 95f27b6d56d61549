"""One plan: path, bus and arm, and all that has limits, as `remora plan --write svg` draws it."""

import sys
from pathlib import Path

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
plan = remora.plan(remora.scenarios()[0])

print(f"{plan.scenario.id}: {plan.verdict}, checksum {plan.checksum}")
for name, value in plan.residuals.items():
    print(f"{name:<14} {value:9.1e}  of {plan.tolerances[name]:.0e}")
print(f"nearest: arm to target {1e3 * plan.clearances['arm']:.1f} mm")

plan.svg(folder / "01_plan.svg")
