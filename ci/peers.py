#!/usr/bin/env python3
"""The embedded QP solver beside those that PyPI has, on the subproblems of plans.

Exports the programs of Stage 2 that a few plans solve, has every solver solve each of them from nothing, one
after the other in every round so that all see the same machine, and judges all answers by one checker of the
conditions of Karush, Kuhn and Tucker, written from the definition of the file format (docs/reference/plan-file.md).

    pip install numpy scipy piqp==0.7.0 qoco==0.3.2 clarabel==0.11.1 osqp==1.1.3 proxsuite==0.8.0
    ci/peers.py --out peers.json

The others get the program with hard dynamics, as sparse matrices, bounds as bounds where they take them. Their
time is that of their solve alone; what they need to take the matrices (allocate, order, analyse) is told apart,
since between the programs of a plan only numbers change. Run it alone on the machine.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp

ROOT = Path(__file__).resolve().parent.parent
TOLERANCE = 1e-8


class Program:
    """A subproblem of a file, by node and as the matrices that a sparse solver takes.

    minimise 1/2 z'P z + q'z  subject to  A z = b,  G z <= h,  lower <= z <= upper
    over z = (x, u, slacks of the soft rows that can be active).
    """

    def __init__(self, path):
        file = json.loads(Path(path).read_text())
        nodes, intervals = file["nodes"], file["intervals"]
        self.path, self.size = path, file["size"]
        self.defect_weight = np.inf if file["defect_weight"] is None else file["defect_weight"]
        self.row_weight = file["row_weight"]

        def stack(entries, key, none=0.0):
            return np.array([np.array([none if v is None else v for v in np.ravel(np.array(e[key], object))], float)
                             .reshape(np.shape(e[key])) for e in entries])

        self.hxx, self.gx = stack(nodes, "hessian_xx"), stack(nodes, "gradient_x")
        self.lx, self.ux = stack(nodes, "lower_x", -np.inf), stack(nodes, "upper_x", np.inf)
        self.rx, self.ro = stack(nodes, "row_x"), stack(nodes, "row_offset")
        self.hux, self.huu = stack(intervals, "hessian_ux"), stack(intervals, "hessian_uu")
        self.gu = stack(intervals, "gradient_u")
        self.lu, self.uu = stack(intervals, "lower_u", -np.inf), stack(intervals, "upper_u", np.inf)
        self.a, self.b, self.c = stack(intervals, "a"), stack(intervals, "b"), stack(intervals, "c")
        self._assemble()

    def _assemble(self):
        n, nx, nu = self.size["nodes"], self.size["states"], self.size["controls"]
        self.rows = [(k, i) for k in range(n) for i in range(self.size["rows"])
                     if np.any(self.rx[k, i]) or self.ro[k, i] > 0.0]
        # Places of variables, node by node, as solvers that look for stages want them.
        count, self.at_x, self.at_u = 0, [], []
        self.at_row = {}
        for k in range(n):
            self.at_x.append(np.arange(count, count + nx))
            count += nx
            if k < n - 1:
                self.at_u.append(np.arange(count, count + nu))
                count += nu
            for row in [row for row in self.rows if row[0] == k]:
                self.at_row[row] = count
                count += 1
        self.at_x, self.at_u = np.array(self.at_x), np.array(self.at_u)
        at_rows = [self.at_row[row] for row in self.rows]
        p, self.q = sp.lil_matrix((count, count)), np.zeros(count)
        lower, upper = np.zeros(count), np.full(count, np.inf)
        for k in range(n):
            p[np.ix_(self.at_x[k], self.at_x[k])] = self.hxx[k]
        for k in range(n - 1):
            p[np.ix_(self.at_u[k], self.at_u[k])] = self.huu[k]
            p[np.ix_(self.at_u[k], self.at_x[k])] = self.hux[k]
            p[np.ix_(self.at_x[k], self.at_u[k])] = self.hux[k].T
        self.P = sp.csc_matrix(p)
        self.q[self.at_x], self.q[self.at_u], self.q[at_rows] = self.gx, self.gu, self.row_weight
        lower[self.at_x], lower[self.at_u], upper[self.at_x], upper[self.at_u] = self.lx, self.lu, self.ux, self.uu
        # What is pinned is an equality: an interior point has no room between two bounds that are one.
        self.pinned = np.flatnonzero(lower == upper)
        dynamics = sp.lil_matrix(((n - 1) * nx, count))
        for k in range(n - 1):
            rows = np.arange(k * nx, (k + 1) * nx)
            dynamics[np.ix_(rows, self.at_x[k])] = self.a[k]
            dynamics[np.ix_(rows, self.at_u[k])] = self.b[k]
            dynamics[np.ix_(rows, self.at_x[k + 1])] = -np.eye(nx)
        pins = sp.csc_matrix((np.ones(len(self.pinned)), (range(len(self.pinned)), self.pinned)),
                             (len(self.pinned), count))
        self.A = sp.csc_matrix(sp.vstack([dynamics, pins]))
        self.b_eq = np.concatenate([-self.c.ravel(), lower[self.pinned]])
        self.lower, self.upper = lower.copy(), upper.copy()
        self.lower[self.pinned], self.upper[self.pinned] = -np.inf, np.inf
        g = sp.lil_matrix((len(self.rows), count))
        for j, (k, i) in enumerate(self.rows):
            g[j, self.at_x[k]] = self.rx[k, i]
            g[j, at_rows[j]] = -1.0
        self.G, self.h = sp.csc_matrix(g), np.array([-self.ro[k, i] for k, i in self.rows])
        # The same with bounds as rows, for those that know no bounds.
        self.below, self.above = np.flatnonzero(np.isfinite(self.lower)), np.flatnonzero(np.isfinite(self.upper))
        eye = sp.eye(count, format="csc")
        self.G_all = sp.csc_matrix(sp.vstack([self.G, eye[self.above], -eye[self.below]]))
        self.h_all = np.concatenate([self.h, self.upper[self.above], -self.lower[self.below]])

    def answer(self, z, eq, rows, bounds):
        """A solution by node: multipliers of the equalities, of the soft rows, and of z's bounds."""
        n, nx = self.size["nodes"], self.size["states"]
        defects = (n - 1) * nx
        m = np.array(bounds, float)
        m[self.pinned] += eq[defects:]
        r = np.zeros((n, self.size["rows"]))
        for j, (k, i) in enumerate(self.rows):
            r[k, i] = rows[j]
        return {
            "x": z[self.at_x], "u": z[self.at_u],
            "defect_multiplier": eq[:defects].reshape(n - 1, nx), "row_multiplier": r,
            "bound_multiplier_x": m[self.at_x], "bound_multiplier_u": m[self.at_u],
        }

    def from_rows(self, z, eq, all_rows):
        """The same where bounds were rows."""
        count, above = len(self.rows), len(self.above)
        bounds = np.zeros(len(z))
        bounds[self.above] += all_rows[count:count + above]
        bounds[self.below] -= all_rows[count + above:]
        return self.answer(z, eq, all_rows[:count], bounds)

    def kkt(self, answer):
        """Largest violation of the optimality conditions; infinite where something is no number."""
        x, u, l = answer["x"], answer["u"], answer["defect_multiplier"]
        mx, mu, r = answer["bound_multiplier_x"], answer["bound_multiplier_u"], answer["row_multiplier"]
        gx = np.einsum("kij,kj->ki", self.hxx, x) + self.gx + np.einsum("kij,ki->kj", self.rx, r) + mx
        gx[:-1] += np.einsum("kij,ki->kj", self.hux, u) + np.einsum("kij,ki->kj", self.a, l)
        gx[1:] -= l
        gu = (np.einsum("kij,kj->ki", self.huu, u) + np.einsum("kij,kj->ki", self.hux, x[:-1]) + self.gu
              + np.einsum("kij,ki->kj", self.b, l) + mu)
        defect = (np.einsum("kij,kj->ki", self.a, x[:-1]) + np.einsum("kij,kj->ki", self.b, u) + self.c - x[1:])
        row = np.einsum("kij,kj->ki", self.rx, x) + self.ro
        found = [np.abs(gx).max(), np.abs(gu).max(), np.abs(defect).max()]
        for value, m, lower, upper in [(x, mx, self.lx, self.ux), (u, mu, self.lu, self.uu)]:
            found.append(np.maximum(lower - value, value - upper).max())
            up, down = np.maximum(m, 0.0), np.maximum(-m, 0.0)
            free = lower != upper
            for push, room in [(up, upper - value), (down, value - lower)]:
                # From a bound that does not exist nothing pushes.
                product = np.where(np.isfinite(room), push * np.maximum(np.where(np.isfinite(room), room, 0.0), 0.0),
                                   push)
                found.append(np.where(free, product, 0.0).max())
        found += [(np.abs(l) - self.defect_weight).max(), (-r).max(), (r - self.row_weight).max(),
                  (np.maximum(-row, 0.0) * r).max(), (np.maximum(row, 0.0) * (self.row_weight - r)).max()]
        return float(np.max(found)) if np.all(np.isfinite(found)) else np.inf


class Embedded:
    """Ours, in a process of its own that is told which program to solve."""

    name, version = "remora, embedded", "this checkout"

    def __init__(self):
        command = ["cargo", "run", "--release", "--quiet", "--locked", "-p", "remora-host", "--example", "solve_qp"]
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def solve(self, program):
        self.process.stdin.write(f"{program.path}\n")
        self.process.stdin.flush()
        found = json.loads(self.process.stdout.readline())
        answer = {key: np.array(found[key]) for key in found if key not in ("seconds", "iterations", "status")}
        return 0.0, found["seconds"], found["iterations"], answer


def timed(work):
    begun = time.perf_counter()
    result = work()
    return time.perf_counter() - begun, result


class Piqp:
    def __init__(self, backend):
        import piqp
        self.piqp, self.backend = piqp, backend
        self.name, self.version = f"PIQP, {backend}", piqp.__version__

    def solve(self, program):
        solver = self.piqp.SparseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = solver.settings.eps_duality_gap_abs = TOLERANCE
        solver.settings.eps_duality_gap_rel = TOLERANCE
        if self.backend == "multistage":
            solver.settings.kkt_solver = self.piqp.KKTSolver.sparse_multistage
        none = np.full(len(program.h), -np.inf)
        setup, _ = timed(lambda: solver.setup(program.P, program.q, program.A, program.b_eq, program.G, none,
                                              program.h, program.lower, program.upper))
        seconds, _ = timed(solver.solve)
        r = solver.result
        bounds = np.array(r.z_bu) - np.array(r.z_bl)
        rows = np.array(r.z_u) - np.array(r.z_l)
        return setup, seconds, r.info.iter, program.answer(np.array(r.x), np.array(r.y), rows, bounds)


class Qoco:
    def __init__(self):
        import qoco
        from importlib.metadata import version
        self.qoco = qoco
        self.name, self.version = "QOCO", version("qoco")

    def solve(self, program):
        solver = self.qoco.QOCO()
        setup, _ = timed(lambda: solver.setup(
            len(program.q), len(program.h_all), len(program.b_eq), sp.triu(program.P, format="csc"), program.q,
            program.A, program.b_eq, program.G_all, program.h_all, len(program.h_all), 0, None,
            abstol=TOLERANCE, reltol=TOLERANCE, verbose=0))
        seconds, r = timed(solver.solve)
        return setup, seconds, r.iters, program.from_rows(np.array(r.x), np.array(r.y), np.array(r.z))


class Clarabel:
    def __init__(self):
        import clarabel
        self.clarabel = clarabel
        self.name, self.version = "Clarabel", clarabel.__version__

    def solve(self, program):
        settings = self.clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
        cones = [self.clarabel.ZeroConeT(len(program.b_eq)), self.clarabel.NonnegativeConeT(len(program.h_all))]
        rows = sp.csc_matrix(sp.vstack([program.A, program.G_all]))
        right = np.concatenate([program.b_eq, program.h_all])
        upper = sp.triu(program.P, format="csc")
        setup, solver = timed(lambda: self.clarabel.DefaultSolver(upper, program.q, rows, right, cones, settings))
        seconds, r = timed(solver.solve)
        z = np.array(r.z)
        return setup, seconds, r.iterations, program.from_rows(np.array(r.x), z[:len(program.b_eq)],
                                                               z[len(program.b_eq):])


class Osqp:
    def __init__(self):
        import osqp
        from importlib.metadata import version
        self.osqp = osqp
        self.name, self.version = "OSQP, polished", version("osqp")

    def solve(self, program):
        eye = sp.eye(len(program.q), format="csc")
        bounded = np.flatnonzero(np.isfinite(program.lower) | np.isfinite(program.upper))
        rows = sp.csc_matrix(sp.vstack([program.A, program.G, eye[bounded]]))
        low = np.concatenate([program.b_eq, np.full(len(program.h), -np.inf), program.lower[bounded]])
        high = np.concatenate([program.b_eq, program.h, program.upper[bounded]])
        solver = self.osqp.OSQP()
        setup, _ = timed(lambda: solver.setup(
            sp.triu(program.P, format="csc"), program.q, rows, low, high, verbose=False, eps_abs=TOLERANCE,
            eps_rel=TOLERANCE, max_iter=4000, polishing=True))
        seconds, r = timed(solver.solve)
        y, eq, soft = np.array(r.y), len(program.b_eq), len(program.h)
        bounds = np.zeros(len(program.q))
        bounds[bounded] = y[eq + soft:]
        return setup, seconds, r.info.iter, program.answer(np.array(r.x), y[:eq], y[eq:eq + soft], bounds)


class ProxQp:
    def __init__(self):
        from importlib.metadata import version
        from proxsuite import proxqp
        self.proxqp = proxqp
        self.name, self.version = "ProxQP", version("proxsuite")

    def solve(self, program):
        solver = self.proxqp.sparse.QP(len(program.q), len(program.b_eq), len(program.h_all))
        solver.settings.eps_abs, solver.settings.eps_rel, solver.settings.verbose = TOLERANCE, 0.0, False
        none = np.full(len(program.h_all), -1e20)
        setup, _ = timed(lambda: solver.init(program.P, program.q, program.A, program.b_eq, program.G_all, none,
                                             program.h_all))
        seconds, _ = timed(solver.solve)
        r = solver.results
        return setup, seconds, r.info.iter, program.from_rows(np.array(r.x), np.array(r.y), np.array(r.z))


def solvers():
    """Those that are installed; ours first."""
    found = [Embedded()]
    for make in [lambda: Piqp("multistage"), lambda: Piqp("sparse"), Qoco, Clarabel, Osqp, ProxQp]:
        try:
            found.append(make())
        except ImportError as error:
            print(f"left out: {error}", file=sys.stderr)
    return found


def exported(ids, folder):
    for name in ids:
        command = ["cargo", "run", "--release", "--quiet", "--locked", "-p", "remora-cli", "--", "export", "--quiet",
                   "--format", "qp", "--integrator", "euler", "--warm-start", "heuristic", "--id", name,
                   "--out", f"{folder}/{name}"]
        subprocess.run(command, cwd=ROOT, check=True)
    return [Program(path) for name in ids for path in sorted(Path(folder, name).glob("stage2-*.qp.json"))]


def measured(programs, peers, rounds):
    """Of each solver and program: times of all rounds, iterations, and how well the conditions are met."""
    found = {peer.name: [{"setup": [], "seconds": []} for _ in programs] for peer in peers}
    for turn in range(rounds):
        for at, program in enumerate(programs):
            for peer in peers[turn % len(peers):] + peers[:turn % len(peers)]:
                setup, seconds, iterations, answer = peer.solve(program)
                one = found[peer.name][at]
                one["setup"].append(setup)
                one["seconds"].append(seconds)
                one["iterations"], one["kkt"] = int(iterations), program.kkt(answer)
        print(f"round {turn + 1} of {rounds}", file=sys.stderr)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ids", default="pub-000,pub-020,pub-040", help="scenarios of the built-in set")
    parser.add_argument("--rounds", type=int, default=3, help="how often each solves each program")
    parser.add_argument("--out", help="JSON file of all numbers")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        programs = exported(asked.ids.split(","), folder)
        peers = solvers()
        found = measured(programs, peers, asked.rounds)
    print(f"{len(programs)} programs of Stage 2 ({asked.ids}, Euler, heuristic start), {asked.rounds} rounds\n")
    print("| solver | version | solve, median [ms] | 95 % | take the matrices [ms] | iterations, mean "
          "| KKT within 1e-8 | 1e-6 | worst |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for peer in peers:
        of = found[peer.name]
        best = 1e3 * np.array([np.median(one["seconds"]) for one in of])
        setup = 1e3 * np.median([np.median(one["setup"]) for one in of])
        kkt = np.array([one["kkt"] for one in of])
        iterations = np.mean([one["iterations"] for one in of])
        print(f"| {peer.name} | {peer.version} | {np.median(best):.2f} | {np.quantile(best, 0.95):.2f} "
              f"| {setup:.2f} | {iterations:.1f} | {np.sum(kkt <= 1e-8)} | {np.sum(kkt <= 1e-6)} | {kkt.max():.1e} |")
    if asked.out:
        Path(asked.out).write_text(json.dumps({"format": "remora-peers/1", "solvers": found}) + "\n")


if __name__ == "__main__":
    main()
