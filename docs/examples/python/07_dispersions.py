"""Where the end effector arrives under typical errors: two plans, flown again and again."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
figure, axes = plt.subplots(figsize=(4.5, 4.2), layout="constrained")
for case in remora.scenarios()[:2]:
    flights = remora.fly(remora.plan(case), errors="typical", seed=1, runs=8)
    misses = 1e3 * np.array([flight.miss_target_m for flight in flights])
    captured = sum(flight.is_captured for flight in flights)
    axes.scatter(misses[:, 0], misses[:, 1], label=f"{case.id}: {captured} of {len(flights)} captured")
axes.add_patch(plt.Circle((0, 0), 12.0, fill=False, linestyle="--"))
axes.set(xlabel="across the port, x [mm]", ylabel="y [mm]", xlim=(-14, 14), ylim=(-14, 14), aspect="equal")
axes.legend(fontsize=8)
figure.savefig(folder / "07_dispersions.svg")
