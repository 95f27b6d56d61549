"""A servicer with the arm of a URDF: joint angles at capture are found, then it is planned for."""

import sys
from pathlib import Path

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
arm = Path(__file__).parents[3] / "fixtures/urdf/spatial.urdf"
mission = remora.Mission.from_urdf(arm, tip="tip")
print(f"{mission.joints} joints, torques up to {mission.torque_limits.round(4)} N m")

case = remora.draw(1, seed=1, mission=mission)[0]
# The built-in models have learnt from an arm of three joints.
plan = remora.plan(case, mission, mode="feasible", initial_guess="heuristic")
print(f"{plan.verdict}, joints at capture {plan.joint_angle[-1].round(3)} rad")

plan.svg(folder / "02_urdf.svg")
