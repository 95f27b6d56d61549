"""Guesses of the caller's: functions of a scene, torques, plans, models; and guesses against each other."""

from pathlib import Path

import numpy as np
import pytest

import remora


def test_a_scene_says_what_a_network_needs(plan: remora.Plan) -> None:
    seen: list[remora.Scene] = []

    def look(scene: remora.Scene) -> np.ndarray:
        seen.append(scene)
        return plan.torques

    again = remora.plan(plan.scenario, initial_guess=look)
    (scene,) = seen
    assert (scene.nodes, scene.joints, scene.dt_s) == (60, 3, pytest.approx(1200.0 / 59))
    assert 0 < scene.preset_node < 59
    assert (scene.position == plan.position).all() and (scene.force == plan.force).all()
    assert (scene.target_attitude == plan.target_attitude).all()
    start = np.concatenate([plan.attitude[0], plan.joint_angle[0], plan.rate[0], plan.joint_rate[0]])
    assert (scene.initial_state == start).all()
    # The torques of a plan, rolled out, lead along it.
    states = scene.rollout(plan.torques)
    assert states.shape == (60, 13)
    assert np.abs(states[:, 4:7] - plan.joint_angle).max() < 1e-3
    assert scene.miss(states[-1]) < 1e-3
    assert (scene.step(0, scene.initial_state, plan.torques[0]) == states[1]).all()
    # And are a guess no worse than the network's, which led to them, and better than the heuristic.
    assert again.start == "given" and again.is_verified
    heuristic = remora.plan(plan.scenario, initial_guess="heuristic")
    assert again.iterations[1] <= plan.iterations[1] < heuristic.iterations[1]


def test_features_are_those_of_the_built_in_models(plan: remora.Plan) -> None:
    def look(scene: remora.Scene) -> np.ndarray:
        body = scene.features(0, scene.initial_state)
        assert body.shape == (70,) and body.dtype == np.float32 and np.isfinite(body).all()
        # Nothing was held before; then comes the time that is left.
        assert (body[:6] == 0.0).all() and body[6] == np.float32(1200.0)
        paper = scene.features(3, scene.initial_state, plan.torques[2], encoding="paper")
        assert paper.shape == (36,)
        assert (paper[:6] == plan.torques[2].astype(np.float32)).all()
        assert (paper[14:17] == plan.position[3].astype(np.float32)).all()
        with pytest.raises(ValueError, match="encoding"):
            scene.features(0, scene.initial_state, encoding="mind")
        with pytest.raises(ValueError, match="node: 60 is none of 60"):
            scene.features(60, scene.initial_state)
        with pytest.raises(ValueError, match="state: expects 13 finite numbers"):
            scene.miss([0.0] * 12)
        return np.zeros((59, 6))

    remora.plan(plan.scenario, initial_guess=look)


def test_torques_and_functions_of_them_plan_the_same(plan: remora.Plan) -> None:
    torques = plan.torques
    given = remora.plan(plan.scenario, initial_guess=torques)
    asked = remora.plan(plan.scenario, initial_guess=lambda _: torques)
    listed = remora.plan(plan.scenario, initial_guess=lambda _: torques.tolist())
    assert given.checksum == asked.checksum == listed.checksum
    assert given.start == "given"


def test_a_worse_guess_is_dropped_for_the_heuristic(case: remora.Scenario) -> None:
    limits = remora.Mission.default().torque_limits
    wild = np.tile(0.3 * limits, (59, 1))
    plan = remora.plan(case, integrator="rk4:4", initial_guess=wild)
    heuristic = remora.plan(case, integrator="rk4:4", initial_guess="heuristic")
    assert plan.start == "fallback" and plan.is_verified
    assert plan.checksum == heuristic.checksum
    assert plan.record is not None and plan.record["start"] == "worse"


def test_a_plan_is_the_guess_of_its_neighbour(plan: remora.Plan) -> None:
    near = remora.Scenario(
        id="near",
        position=plan.scenario.position + [0.02, -0.01, 0.01],
        velocity=plan.scenario.velocity,
        target_attitude=plan.scenario.target_attitude,
        target_rate=plan.scenario.target_rate,
    )
    warm = remora.plan(near, initial_guess=plan)
    cold = remora.plan(near, initial_guess="heuristic")
    assert warm.start == "nominal" and warm.is_verified
    assert warm.iterations[1] < cold.iterations[1]


def test_a_model_of_a_file_is_the_built_in_one(root: Path, case: remora.Scenario) -> None:
    model = remora.Model(root / "fixtures/models/euler.model")
    plan = remora.plan(case, integrator="euler", initial_guess=model)
    built_in = remora.plan(case, integrator="euler", initial_guess="model")
    assert plan.checksum == built_in.checksum and plan.start == "model"
    assert plan.record is not None and plan.record["model"]["checksum"] == model.checksum
    assert plan.record["model"]["name"] == model.name == "euler.model"


def test_both_built_in_models_are_inside(case: remora.Scenario) -> None:
    for integrator in ("euler", "rk4"):
        plan = remora.plan(case, integrator=integrator)
        assert plan.start == "model" and plan.record is not None
        assert plan.record["model"]["name"] == f"{integrator}.model (built in)"


def test_guesses_are_compared_pair_by_pair() -> None:
    cases = remora.draw(6, seed=5)
    torques = {case.id: remora.plan(case, integrator="euler").torques for case in cases}
    by_start = {tuple(case.position): torques[case.id] for case in cases}

    def perfect(scene: remora.Scene) -> np.ndarray:
        return by_start[tuple(scene.position[0])]

    found = remora.compare_guesses(
        {"heuristic": "heuristic", "ours": "model", "perfect": perfect}, cases, integrator="euler"
    )
    assert list(found) == ["heuristic", "ours", "perfect"]
    for of in found.values():
        assert of["success"]["count"] == of["success"]["of"] == 6
        assert of["fallbacks"] == 0
    # Against itself nothing changes; a perfect guess saves iterations, beyond doubt.
    assert found["heuristic"]["against"]["iterations"] == {"value": 0.0, "low": 0.0, "high": 0.0}
    saved = found["perfect"]["against"]["iterations"]
    assert saved["low"] <= saved["value"] <= saved["high"] < 0.0
    assert found["perfect"]["against"]["pairs"] == 6
    table = remora.plan_many(cases, integrator="euler", initial_guess="heuristic")
    assert found["heuristic"]["iterations"]["mean"]["value"] == pytest.approx(table["stage2_iterations"].mean())
    assert "perfect" in str(found) and "6/6" in str(found)
