"""Plans spread over processes by Dask, or over machines: with `distributed.Client("scheduler:8786")` first, the same
lines run on a cluster whose workers have the wheel."""

import sys
from pathlib import Path

import dask
import matplotlib.pyplot as plt
import numpy as np

import remora


def share(first: int, end: int) -> dict[str, np.ndarray]:
    """Plans of scenarios first to end: a worker draws its own, each is a function of seed and index."""
    table = remora.plan_many(remora.draw(end, seed=1)[first:], jobs=1)
    return {name: table[name] for name in ("target_rate_rad_s", "stage2_cost", "verified")}


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    tasks = [dask.delayed(share)(first, first + 4) for first in range(0, 24, 4)]
    shares = dask.compute(*tasks, scheduler="processes", num_workers=2)
    table = {name: np.concatenate([one[name] for one in shares]) for name in shares[0]}
    print(f"{table['verified'].sum()} of {len(table['verified'])} verified, in {len(shares)} shares")
    figure, axes = plt.subplots(layout="constrained")
    axes.scatter(1e3 * table["target_rate_rad_s"], table["stage2_cost"], s=12)
    axes.set(xlabel="tumble [mrad/s]", ylabel="cost of Stage 2")
    figure.savefig(folder / "11_dask.svg")
