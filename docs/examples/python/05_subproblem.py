"""The convex programs of a plan, for other solvers: the pattern of one, and how the active bounds change."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import remora

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
plan = remora.plan(remora.scenarios()[0], initial_guess="heuristic")
programs = [remora.subproblem(plan, k) for k in range(1, min(plan.iterations[1], 8) + 1)]
first = programs[0]
size, controls = first.a.shape[1], first.b.shape[2]

# States and controls node by node: x0 u0 x1 u1 ...; of the first six nodes.
shown, stride = 6, size + controls
hessian = np.zeros((shown * stride, shown * stride))
for k in range(shown):
    x, u = slice(k * stride, k * stride + size), slice(k * stride + size, (k + 1) * stride)
    hessian[x, x], hessian[u, u] = first.hessian_xx[k], first.hessian_uu[k]
    hessian[u, x], hessian[x, u] = first.hessian_ux[k], first.hessian_ux[k].T
dynamics = np.zeros(((shown - 1) * size, shown * stride))
for k in range(shown - 1):
    row = slice(k * size, (k + 1) * size)
    dynamics[row, k * stride : (k + 1) * stride] = np.hstack([first.a[k], first.b[k]])
    dynamics[row, (k + 1) * stride : (k + 1) * stride + size] = -np.eye(size)

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
left.spy(hessian, markersize=1)
left.set_title("Hessian, six nodes")
middle.spy(dynamics, markersize=1)
middle.set_title("dynamics")
right.set_title("active bounds")
active = [sum(int((np.abs(p.solution[of]) > 1e-6).sum()) for of in ("bound_multiplier_x", "bound_multiplier_u"))
          for p in programs if p.solution]
right.plot(range(1, len(active) + 1), active, "o-")
right.set(xlabel="iteration of Stage 2")
figure.savefig(folder / "05_subproblem.svg")
print(f"{len(programs)} programs of {first.nodes} nodes, {size} states and {controls} controls")
