"""Guesses of one's own, against the learned one and the heuristic: paired, with intervals."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
planned = remora.plan(remora.draw(1, seed=9)[0])


def one_fits_all(scene: remora.Scene) -> np.ndarray:
    """The torques of some other approach: as good as a memory of one example."""
    return planned.torques


def at_rest(scene: remora.Scene) -> np.ndarray:
    """No torque at all: the bus drifts."""
    return np.zeros((scene.nodes - 1, 3 + scene.joints))


guesses = {"heuristic": "heuristic", "at rest": at_rest, "one fits all": one_fits_all, "built-in model": "model"}
found = remora.compare_guesses(guesses, remora.draw(12, seed=2), jobs=2)
print(found)

figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
for row, (name, of) in enumerate(found.items()):
    mean = of["iterations"]["mean"]
    axes.barh(row, mean["value"], color="tab:blue", alpha=0.5)
    axes.plot([mean["low"], mean["high"]], [row, row], color="black")
    axes.text(0.3, row, f"dropped {of['fallbacks']} times" if of["fallbacks"] else "", va="center", fontsize=8)
axes.set(yticks=range(len(found)), yticklabels=list(found), xlabel="iterations of Stage 2, mean and 95 % interval")
axes.invert_yaxis()
figure.savefig(folder / "04_own_guess.svg")
