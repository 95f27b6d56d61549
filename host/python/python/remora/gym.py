"""Approaches as an environment for policies, by gymnasium's interface; steps are taken in Rust.

A policy sees the planner's scene at a node, as the built-in models do (`encoding="body"`: everything in bus
axes, with what lies ahead), with the servicer's numbers as well (`encoding="servicer"`), or as the paper's network
does (`encoding="paper"`), the torques of the interval before among it. It answers torques of bus and joints as shares
of their limits, from -1 to 1. The reward is minus what the plan's cost counts for them and, at the last node, minus
`miss_weight` times the end effector's distance from the port in metres. An episode in which bus or joints turn faster
than 1 rad/s is lost: it ends, and its miss counts as 100 m. The translation of the centre of mass is planned, once,
when an environment is made.

    >>> import gymnasium, remora.gym
    >>> env = gymnasium.make("remora/Approach-v0")
    >>> observation, info = env.reset(seed=1)
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Space
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from remora._remora import Episodes, Mission, Scenario
from remora.functions import draw
from remora.names import Encoding, Integrator

__all__ = ["ApproachEnv", "ApproachVectorEnv"]

_Floats = NDArray[np.float32]

#: Most environments at once.
MOST = 1_000_000

#: Approaches of an environment that is given none.
DEFAULT_COUNT = 16


def _cases(cases: Sequence[Scenario] | None, mission: Mission | None) -> list[Scenario]:
    """Approaches that are given, or drawn."""
    if cases is None:
        return draw(DEFAULT_COUNT, 1, mission)
    if not isinstance(cases, Iterable):
        raise ValueError(f"cases: expected scenarios, found {cases!r}")
    return list(cases)


def _spaces(episodes: Episodes) -> tuple[Space[_Floats], Space[_Floats]]:
    """What a policy sees and what it answers."""
    seen = Box(-np.inf, np.inf, (episodes.features,), np.float32)
    answered = Box(-1.0, 1.0, (episodes.actions,), np.float32)
    return cast(Space[_Floats], seen), cast(Space[_Floats], answered)


class ApproachEnv(gymnasium.Env[_Floats, _Floats]):
    """One approach per episode: those given, or the first that seed 1 draws.

    Parameters
    ----------
    cases : the scenarios; None draws sixteen.
    mission : what is planned for; None is the built-in mission.
    integrator : as of `remora.plan`.
    encoding : what a policy sees: "body", "servicer" or "paper".
    miss_weight : what a metre of miss costs at the end.

    Raises
    ------
    ValueError : an argument that makes no sense.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        cases: Sequence[Scenario] | None = None,
        mission: Mission | None = None,
        *,
        integrator: Integrator = "rk4",
        encoding: Encoding = "body",
        miss_weight: float = 1.0,
    ) -> None:
        self.cases = _cases(cases, mission)
        self._episodes = Episodes(
            self.cases, mission, count=1, integrator=integrator, encoding=encoding, miss_weight=miss_weight, jobs=1
        )
        self.observation_space, self.action_space = _spaces(self._episodes)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Floats, dict[str, Any]]:
        """Begins another approach: `options["approach"]`, or one that is drawn."""
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(len(self.cases)))
        approach = drawn if options is None else int(options.get("approach", drawn))
        self._episodes.begin(0, approach)
        return self._episodes.observe()[0], {"approach": approach}

    def step(self, action: _Floats) -> tuple[_Floats, float, bool, bool, dict[str, Any]]:
        """Holds torques until the next node."""
        actions = np.asarray(action, np.float32)[np.newaxis]
        seen, rewards, ended = self._episodes.step(actions)
        info = {"cost": float(self._episodes.costs()[0]), "miss_m": float(self._episodes.misses()[0])}
        return seen[0], float(rewards[0]), bool(ended[0]), False, info


class ApproachVectorEnv(VectorEnv[_Floats, _Floats, NDArray[Any]]):
    """Many approaches at once, stepped on several threads: environment `i` of seed `s` is `ApproachEnv` of `s + i`.

    An environment that has ended begins again with the next step, whose action is not looked at.

    Parameters
    ----------
    num_envs : how many.
    cases, mission, integrator, encoding, miss_weight : as of `ApproachEnv`.
    jobs : threads; None is as many as there are cores.

    Raises
    ------
    ValueError : an argument that makes no sense.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 64,
        cases: Sequence[Scenario] | None = None,
        mission: Mission | None = None,
        *,
        integrator: Integrator = "rk4",
        encoding: Encoding = "body",
        miss_weight: float = 1.0,
        jobs: int | None = None,
    ) -> None:
        super().__init__()
        if not isinstance(num_envs, int) or not 1 <= num_envs <= MOST:
            raise ValueError(f"num_envs: must be a whole number from 1 to {MOST}, found {num_envs!r}")
        self.num_envs = num_envs
        self.cases = _cases(cases, mission)
        self._episodes = Episodes(
            self.cases,
            mission,
            count=num_envs,
            integrator=integrator,
            encoding=encoding,
            miss_weight=miss_weight,
            jobs=jobs,
        )
        self.single_observation_space, self.single_action_space = _spaces(self._episodes)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._draws = [seeding.np_random()[0] for _ in range(num_envs)]
        self._ended = np.zeros(num_envs, np.bool_)

    def _approach(self, index: int) -> int:
        """The next approach of an environment."""
        return int(self._draws[index].integers(len(self.cases)))

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Floats, dict[str, Any]]:
        """Begins all of them again; `seed` is that of the first, or one for each."""
        super().reset(seed=seed if isinstance(seed, int) else None)
        if isinstance(seed, int):
            seed = [seed + i for i in range(self.num_envs)]
        if seed is not None:
            self._draws = [seeding.np_random(of)[0] for of in seed]
        approaches = np.array([self._approach(i) for i in range(self.num_envs)])
        for i, approach in enumerate(approaches):
            self._episodes.begin(i, int(approach))
        self._ended[:] = False
        return self._episodes.observe(), {"approach": approaches, "_approach": ~self._ended}

    def step(
        self, actions: _Floats
    ) -> tuple[_Floats, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Holds torques until the next node, everywhere; what had ended begins again."""
        begins = np.full(self.num_envs, -1)
        for i in np.flatnonzero(self._ended):
            begins[i] = self._approach(int(i))
        seen, rewards, ended = self._episodes.step(np.asarray(actions, np.float32), begins)
        info: dict[str, Any] = {}
        if ended.any():
            info = {"cost": self._episodes.costs(), "_cost": ended, "miss_m": self._episodes.misses(), "_miss_m": ended}
        self._ended = ended
        return seen, rewards, ended, np.zeros(self.num_envs, np.bool_), info


gymnasium.register(
    "remora/Approach-v0",
    entry_point="remora.gym:ApproachEnv",
    vector_entry_point="remora.gym:ApproachVectorEnv",
)
