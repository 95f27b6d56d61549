"""The environment: by gymnasium's own checker, and by what is known of plans."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import remora
from remora.gym import ApproachEnv, ApproachVectorEnv


@pytest.fixture(scope="module")
def cases() -> list[remora.Scenario]:
    return remora.scenarios()[:4]


def test_gymnasium_finds_nothing_wrong(cases: list[remora.Scenario]) -> None:
    for encoding in ("body", "paper", "servicer"):
        env = ApproachEnv(cases, integrator="euler", encoding=encoding)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            check_env(env, skip_render_check=True)
        # Features have no bounds, which the checker mentions.
        assert all("infinity" in str(of.message) or "no spec" in str(of.message) for of in said), said


def test_it_is_known_by_name(cases: list[remora.Scenario]) -> None:
    env = gymnasium.make("remora/Approach-v0", cases=cases, integrator="euler", disable_env_checker=True)
    observation, info = env.reset(seed=3)
    assert env.observation_space.contains(observation) and 0 <= info["approach"] < 4
    envs = gymnasium.make_vec(
        "remora/Approach-v0", 3, vectorization_mode="vector_entry_point", cases=cases, integrator="euler"
    )
    seen, _ = envs.reset(seed=3)
    assert seen.shape == (3, 70) and envs.observation_space.contains(seen)


def test_a_plans_torques_earn_minus_its_cost(cases: list[remora.Scenario]) -> None:
    env = ApproachEnv(cases, integrator="rk4", miss_weight=3.0)
    plan = remora.plan(cases[2])
    actions = plan.torques / plan.mission.torque_limits
    seen, info = env.reset(seed=1, options={"approach": 2})
    assert info == {"approach": 2}
    total, ended = 0.0, False
    for k, action in enumerate(actions):
        assert not ended
        seen, reward, ended, truncated, info = env.step(action.astype(np.float32))
        assert seen.shape == (70,) and not truncated
        total += reward
    assert ended and k == 58
    assert info["miss_m"] < 1e-3
    assert info["cost"] == pytest.approx(plan.costs[1], rel=1e-5)
    assert total == pytest.approx(-info["cost"] - 3.0 * info["miss_m"])


def test_an_action_is_a_share_of_a_limit(cases: list[remora.Scenario]) -> None:
    env = ApproachEnv(cases, integrator="euler")
    env.reset(seed=1, options={"approach": 0})
    action = np.array([0.5, -0.25, 1.0, -1.0, 0.0, 0.125], np.float32)
    seen, _, _, _, _ = env.step(action)
    # Among what is seen is the torque that was held.
    held = action * remora.Mission.default().torque_limits
    assert seen[:6] == pytest.approx(held, rel=1e-6)
    # Beyond a limit nothing is held.
    env.reset(seed=1, options={"approach": 0})
    beyond, _, _, _, _ = env.step(np.full(6, 9.0, np.float32))
    assert beyond[:6] == pytest.approx(remora.Mission.default().torque_limits, rel=1e-6)


def episode(env: ApproachVectorEnv, seed: int, steps: int = 130) -> list[np.ndarray]:
    """All that a policy that draws sees and earns."""
    env.action_space.seed(seed)
    told: list[np.ndarray] = [env.reset(seed=seed)[0]]
    for _ in range(steps):
        seen, rewards, ended, _, _ = env.step(env.action_space.sample())
        told += [seen, rewards, ended]
    return told


def test_the_same_seed_has_the_same_bits_on_any_number_of_threads(cases: list[remora.Scenario]) -> None:
    first = episode(ApproachVectorEnv(20, cases, jobs=1), 7)
    again = episode(ApproachVectorEnv(20, cases, jobs=2), 7)
    other = episode(ApproachVectorEnv(20, cases, jobs=2), 8)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0], other[0])


def test_many_are_each_of_them_one(cases: list[remora.Scenario]) -> None:
    """Environment `i` of seed `s` is the single one of seed `s + i`, through the end and the beginning after it."""
    envs = ApproachVectorEnv(3, cases, integrator="euler", jobs=2)
    ones = [ApproachEnv(cases, integrator="euler") for _ in range(3)]
    seen, _ = envs.reset(seed=5)
    alone = [env.reset(seed=5 + i)[0] for i, env in enumerate(ones)]
    assert np.array_equal(seen, alone)
    draw = np.random.default_rng(1)
    over, ends = [False] * 3, 0
    for _ in range(125):
        actions = draw.uniform(-0.1, 0.1, (3, 6)).astype(np.float32)
        seen, rewards, ended, _, info = envs.step(actions)
        for i, env in enumerate(ones):
            if over[i]:
                expected, earned, end = env.reset()[0], 0.0, False
            else:
                expected, earned, end, _, last = env.step(actions[i])
                assert not end or info["miss_m"][i] == last["miss_m"]
            assert np.array_equal(seen[i], expected)
            assert (rewards[i], ended[i]) == (earned, end)
        over = list(ended)
        ends += sum(over)
    # Some were lost on the way, some came to their last node.
    assert ends > 6


def test_a_lost_episode_ends(cases: list[remora.Scenario]) -> None:
    env = ApproachEnv(cases, integrator="euler")
    env.reset(seed=1)
    for step in range(59):
        seen, reward, ended, _, info = env.step(np.array([0, 0, 0, 0, 0, 1], np.float32))
        assert np.isfinite(seen).all() and np.isfinite(reward)
        if ended:
            break
    assert step < 58 and info["miss_m"] == 100.0 and reward < -100.0


def test_bad_actions_are_named(cases: list[remora.Scenario]) -> None:
    env = ApproachEnv(cases, integrator="euler")
    env.reset(seed=1)
    with pytest.raises(ValueError, match="actions: hold a number that is not finite"):
        env.step(np.full(6, np.nan, np.float32))
    with pytest.raises(ValueError, match="actions: have shape"):
        env.step(np.zeros(5, np.float32))
    with pytest.raises(ValueError, match="approach: 4 is none of 4"):
        env.reset(options={"approach": 4})
    with pytest.raises(ValueError, match="miss_weight"):
        ApproachEnv(cases, miss_weight=float("nan"))
    with pytest.raises(ValueError, match="encoding"):
        ApproachEnv(cases, encoding="mind")
    with pytest.raises(ValueError, match="num_envs: must be a whole number from 1 to 1000000"):
        ApproachVectorEnv(10**18, cases)
