"""A policy in the gymnasium environment: torques in four pieces, found by the cross-entropy method.

It may earn more than the planner, for whom pointing, joints, clearances and the arrival at rest are limits too.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora
from remora.gym import ApproachVectorEnv

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
case = remora.scenarios()[0]
count, pieces, steps = 128, 4, 59
envs = ApproachVectorEnv(count, [case], integrator="rk4:4")
draw = np.random.default_rng(1)
mean, spread = np.zeros((pieces, 6)), np.full((pieces, 6), 0.02)
earned = []
for generation in range(25):
    genes = draw.normal(mean, spread, (count, pieces, 6))
    envs.reset(seed=1)
    returns = np.zeros(count)
    for k in range(steps):
        _, rewards, _, _, info = envs.step(genes[:, k * pieces // steps])
        returns += rewards
    best = np.argsort(returns)[-16:]
    mean, spread = genes[best].mean(axis=0), genes[best].std(axis=0) + 1e-4
    earned.append(returns[best].mean())
print(f"{count * steps * len(earned)} steps; the best ends {info['miss_m'][best[-1]]:.2f} m from the port")

figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.plot(earned, label="cross-entropy method, best eighth")
plan = remora.plan(case, integrator="rk4:4")
axes.axhline(-plan.costs[1], linestyle="--", color="black", label="the planner")
axes.set(xlabel="generation", ylabel="return")
axes.legend(fontsize=8)
figure.savefig(folder / "10_policy.svg")
