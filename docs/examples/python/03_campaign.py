"""Many plans on all cores: a table, and three looks at it."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
cases = remora.draw(24, seed=1)
table = remora.plan_many(cases)
table.to_parquet(folder / "03_campaign.parquet")
print(f"{table['verified'].sum()} of {len(cases)} verified, {table['cpu_time_s'].sum():.1f} s of processor time")

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
left.hist(table["stage2_iterations"], bins=range(1, 15), align="left")
left.set(xlabel="iterations of Stage 2", ylabel="plans")
middle.hist(1e3 * table["delta_v_m_s"], bins=12)
middle.set(xlabel="velocity change [mm/s]")
right.scatter(1e3 * table["target_rate_rad_s"], table["stage2_cost"], s=12)
right.set(xlabel="tumble [mrad/s]", ylabel="cost of Stage 2")
figure.savefig(folder / "03_campaign.svg")
