"""Own guesses, a feedback law and a memory, against the learned one and the heuristic: paired, with intervals."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
remembered = remora.plan(remora.draw(1, seed=9)[0]).torques


def memory(scene: remora.Scene) -> np.ndarray:
    """The torques of another approach."""
    return remembered


def feedback(scene: remora.Scene) -> np.ndarray:
    """The mean rates that would make the turn and the joints' travel that are left, by torques that reach them."""
    state, torques = scene.initial_state, np.zeros((scene.nodes - 1, 6))
    for node, held in enumerate(torques):
        wanted = scene.features(node, state)[-6:].astype(float)
        q = state[:4]
        wanted[:3] += 2.0 * np.cross(q[:3], np.cross(q[:3], wanted[:3]) + q[3] * wanted[:3])
        rates = [scene.step(node, state, torque)[7:] for torque in 1e-4 * np.vstack([np.zeros(6), np.eye(6)])]
        by_torque = (np.array(rates[1:]) - rates[0]).T / 1e-4
        held[:] = np.linalg.solve(by_torque, wanted - rates[0])
        state = scene.step(node, state, held)
    return torques


guesses = {"heuristic": "heuristic", "a memory": memory, "feedback": feedback, "built-in model": "model"}
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
