"""A plan flown in a world that it does not know: planned beside flown, and what navigation made of it."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
plan = remora.plan(remora.scenarios()[0])
flight = remora.fly(plan, errors="typical", seed=3)
print(f"{flight.ending}: {1e3 * flight.miss_m:.1f} mm off, {1e3 * flight.speed_m_s:.2f} mm/s")

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
for joint in range(3):
    left.plot(flight.time, flight.joint_angle[:, joint], color=f"C{joint}", label=f"joint {joint + 1}")
    left.plot(plan.time, plan.joint_angle[:, joint], "--", color=f"C{joint}", linewidth=2, alpha=0.5)
left.set(xlabel="time [s]", ylabel="joint angle [rad], planned dashed")
left.legend(fontsize=8)
middle.semilogy(flight.time, np.linalg.norm(flight.tip, axis=1))
middle.set(xlabel="time [s]", ylabel="end effector from the port [m]")
right.plot(flight.time, 1e3 * flight.tracking[:, 0], label="position [mm]")
right.plot(flight.time, 1e3 * flight.tracking[:, 1], label="attitude [mrad]")
right.set(xlabel="time [s]", ylabel="tracking error")
right.legend(fontsize=8)
figure.savefig(folder / "06_flight.svg")
