"""Why plans by explicit Euler, the paper's discretisation, cannot be flown: their torques, integrated finely."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
case = remora.scenarios()[0]
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
for integrator in ("euler", "rk4"):
    plan = remora.plan(case, integrator=integrator)
    found: list[np.ndarray] = []

    def follow(scene: remora.Scene) -> np.ndarray:
        """Rolls the plan's torques out by Runge-Kutta steps of a fiftieth of an interval."""
        found.append(scene.rollout(plan.torques))
        return plan.torques

    remora.plan(case, integrator="rk4:50", mode="feasible", initial_guess=follow)
    off = np.abs(found[0][:, 4:7] - plan.joint_angle).max(axis=1)
    print(f"{integrator}: joints end {off[-1]:.1e} rad beside the plan")
    axes.semilogy(plan.time[1:], off[1:], label=f"plan by {integrator}")
axes.set(xlabel="time [s]", ylabel="joint farthest from its plan [rad]")
axes.legend()
figure.savefig(folder / "08_between_nodes.svg")
