"""Planning again from the middle of a plan, a little beside it: what is left of the plan is the guess."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
plan = remora.plan(remora.scenarios()[0])


def in_body(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A vector of RTN in the axes of a body."""
    return v + 2.0 * np.cross(-q[:3], np.cross(-q[:3], v) + q[3] * v)


figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.plot(plan.time, np.linalg.norm(plan.position, axis=1), color="black", label="first plan")
for node in (15, 25, 35):
    case = remora.Scenario(
        id=f"from-{node}",
        position=plan.position[node] + [0.1, -0.05, 0.05],
        velocity=plan.velocity[node],
        target_attitude=plan.target_attitude[node],
        target_rate=in_body(plan.target_attitude[node], plan.target_rate[node]),
        bus_attitude=plan.attitude[node],
        bus_rate=plan.rate[node],
        joint_angle=plan.joint_angle[node],
        joint_rate=plan.joint_rate[node],
        duration_s=plan.time[-1] - plan.time[node],
        nodes=60 - node,
    )
    again = remora.plan(case, initial_guess=(plan, plan.time[node]))
    print(f"{again.scenario.id}: {again.verdict} from {again.start}, {again.iterations[1]} iterations")
    label = f"again at {plan.time[node]:.0f} s"
    axes.plot(plan.time[node] + again.time, np.linalg.norm(again.position, axis=1), label=label)
axes.set(xlabel="time [s]", ylabel="distance of the centre of mass [m]")
axes.legend(fontsize=8)
figure.savefig(folder / "09_replanning.svg")
