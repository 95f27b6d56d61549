"""Plans again what a plan's file holds, and prints the plan's checksum. Usage: replay.py PLAN MODE [MODEL]

MODEL is `heuristic`, `model` for the built-in one, or a file.
"""

import sys

import remora

file, mode, model = sys.argv[1:]
guess = model if model in ("heuristic", "model") else remora.Model(model)
plan = remora.Plan.load(file)
again = remora.plan(plan.scenario, plan.mission, integrator=plan.integrator, mode=mode, initial_guess=guess)
print(again.checksum)
