"""Subproblems: what is handed to other solvers is the program that the embedded solver solved."""

from pathlib import Path

import numpy as np
import pytest

import remora


@pytest.fixture(scope="module", params=[(1, 2), (2, 1), (2, 3)], ids=str)
def qp(request: pytest.FixtureRequest, plan: remora.Plan) -> remora.Subproblem:
    stage, k = request.param
    return remora.subproblem(plan, k, stage=stage)


def test_its_solution_satisfies_the_conditions_of_optimality(qp: remora.Subproblem) -> None:
    """The Karush-Kuhn-Tucker conditions as `docs/reference/plan-file.md` writes them: they prove optimality."""
    assert qp.status == "solved" and qp.solution is not None
    s = {name: np.asarray(value) for name, value in qp.solution.items()}
    x, u, lam, rows = s["x"], s["u"], s["defect_multiplier"], s["row_multiplier"]
    scale = max(1.0, np.abs(qp.gradient_x).max(), np.abs(qp.gradient_u).max(), np.abs(lam).max())
    in_x = np.einsum("kij,kj->ki", qp.hessian_xx, x) + qp.gradient_x + s["bound_multiplier_x"]
    in_x[:-1] += np.einsum("kji,kj->ki", qp.hessian_ux, u) + np.einsum("kji,kj->ki", qp.a, lam)
    in_x[1:] -= lam
    in_x += np.einsum("kji,kj->ki", qp.row_x, rows)
    in_u = np.einsum("kij,kj->ki", qp.hessian_uu, u) + np.einsum("kij,kj->ki", qp.hessian_ux, x[:-1])
    in_u += qp.gradient_u + np.einsum("kji,kj->ki", qp.b, lam) + s["bound_multiplier_u"]
    assert np.abs(in_x).max() < 1e-6 * scale
    assert np.abs(in_u).max() < 1e-6 * scale
    # Bounds hold, and multipliers push the right way.
    for value, lower, upper in ((x, qp.lower_x, qp.upper_x), (u, qp.lower_u, qp.upper_u)):
        assert (value >= lower - 1e-6).all() and (value <= upper + 1e-6).all()
    slack = x[1:] - np.einsum("kij,kj->ki", qp.a, x[:-1]) - np.einsum("kij,kj->ki", qp.b, u) - qp.c
    violated = np.maximum(np.einsum("kij,kj->ki", qp.row_x, x) + qp.row_offset, 0.0)
    assert (rows >= -1e-9).all() and (rows <= qp.row_weight * (1 + 1e-6)).all()
    if np.isfinite(qp.defect_weight):
        assert (np.abs(lam) <= qp.defect_weight * (1 + 1e-6)).all()
        soft = qp.defect_weight * np.abs(slack).sum()
    else:
        assert np.abs(slack).max() < 1e-6
        soft = 0.0
    objective = qp.constant + soft + qp.row_weight * violated.sum()
    objective += 0.5 * np.einsum("ki,kij,kj", x, qp.hessian_xx, x) + (qp.gradient_x * x).sum()
    objective += 0.5 * np.einsum("ki,kij,kj", u, qp.hessian_uu, u) + (qp.gradient_u * u).sum()
    objective += np.einsum("ki,kij,kj", u, qp.hessian_ux, x[:-1])
    assert objective == pytest.approx(float(s["objective"]), abs=1e-6 * scale)


def test_it_is_convex(qp: remora.Subproblem) -> None:
    for k in range(qp.nodes - 1):
        block = np.block([[qp.hessian_xx[k], qp.hessian_ux[k].T], [qp.hessian_ux[k], qp.hessian_uu[k]]])
        values = np.linalg.eigvalsh(block)
        assert values[0] >= -1e-9 * values[-1]


def test_it_is_what_the_program_exports(plan: remora.Plan, here: Path) -> None:
    qp = remora.subproblem(plan, 2)
    qp.save("a.qp.json")
    text = (here / "a.qp.json").read_text()
    assert '"format": "remora-qp/1"' in text and '"scenario": "pub-000"' in text
    assert (qp.stage, qp.iteration, qp.nodes) == (2, 2, 60)


def test_a_loaded_plan_has_the_same(plan: remora.Plan, here: Path) -> None:
    plan.save("a.plan.json")
    loaded = remora.Plan.load("a.plan.json")
    assert (remora.subproblem(loaded, 2).a == remora.subproblem(plan, 2).a).all()


def test_own_guesses_are_made_again(plan: remora.Plan, here: Path) -> None:
    given = remora.plan(plan.scenario, initial_guess=lambda _: plan.torques)
    assert remora.subproblem(given, 1).iteration == 1
    given.save("a.plan.json")
    with pytest.raises(ValueError, match='its start, "given", is not in its file'):
        remora.subproblem(remora.Plan.load("a.plan.json"), 1)


def test_what_is_not_there_is_said(plan: remora.Plan) -> None:
    last = plan.iterations[1]
    with pytest.raises(ValueError, match=f"k: {last + 1} is none of stage 2's iterations, 1 to {last}"):
        remora.subproblem(plan, last + 1)
    with pytest.raises(ValueError, match="stage: must be 1 or 2"):
        remora.subproblem(plan, 1, stage=3)
