"""Stubs of the compiled part. Shapes: N nodes, J joints of the arm."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Final, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from remora.guess import Guess
from remora.names import Controller, Encoding, Ending, Integrator, JointControl, Mode, Start, Verdict

__all__ = [
    "Episodes",
    "Flight",
    "Mission",
    "Model",
    "Plan",
    "Refused",
    "Rows",
    "Scenario",
    "Scene",
    "Subproblem",
    "__version__",
    "compare_guesses",
    "draw",
    "fly",
    "plan",
    "plan_many",
    "scenarios",
    "subproblem",
]

_Path: TypeAlias = str | PathLike[str]
_Array: TypeAlias = NDArray[np.float64]

__version__: Final[str]

class Refused(ValueError):
    """A scenario that no plan can end well; `constraint` names why."""

    constraint: str

@final
class Mission:
    """A mission: target, orbit, servicer with its arm, limits, weights and tolerances."""

    @staticmethod
    def default() -> Mission:
        """The built-in mission."""

    @staticmethod
    def from_toml(path: _Path) -> Mission:
        """The mission of a file (`*.mission.toml`)."""

    @staticmethod
    def from_urdf(
        path: _Path,
        *,
        tip: str | None = None,
        base: str | None = None,
        bus: _Path | None = None,
        mount: Sequence[float] | None = None,
        boresight: Sequence[float] | None = None,
        axis: Sequence[float] | None = None,
        start: Sequence[float] | None = None,
        armature: Sequence[float] | None = None,
        limits: Mapping[str, Sequence[float]] | None = None,
        hold: Mapping[str, float] | None = None,
        point_mass: set[str] | None = None,
    ) -> Mission:
        """A mission for the arm of a URDF, as `remora mission import` makes it.

        `tip` and `base` are links, `bus` a mission that gives all else; `limits` are lower, upper, rate and
        torque by joint; the own inertia of the links `point_mass` is left out.
        """

    @property
    def joints(self) -> int:
        """Number of the arm's joints."""

    @property
    def nodes(self) -> int:
        """Number of a plan's nodes."""

    @property
    def duration_s(self) -> float:
        """Time to capture [s]."""

    @property
    def checksum(self) -> str:
        """Checksum of all its numbers."""

    @property
    def torque_limits(self) -> _Array:
        """Largest torques: of the bus about its axes, then of the joints [N m]."""

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> Mission:
        """The mission of a dict with the keys of a mission file; missing keys keep their defaults."""

    def to_dict(self) -> dict[str, Any]:
        """All values, as a dict with the keys of the mission file."""

    def replace(self, **sections: Any) -> Mission:
        """The mission with other values: `replace(target={"mass_kg": 60.0})`. Other keys of a section stay."""

    def to_toml(self, path: _Path | None = None) -> str:
        """The mission as a file's text; written to `path` where one is given."""

    def __getattr__(self, name: str, /) -> Any:
        """A section of the mission file: `mission.servicer.bus_mass_kg`."""

    def __dir__(self) -> list[str]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    def _repr_html_(self) -> str: ...
    @staticmethod
    def _of_json(text: str) -> Mission: ...
    @staticmethod
    def _of_text(text: str) -> Mission: ...

@final
class Scenario:
    """One approach: how the target tumbles, where the servicer starts, and how long it has."""

    def __new__(
        cls,
        *,
        position: Sequence[float] | _Array,
        target_attitude: Sequence[float] | _Array = (0.0, 0.0, 0.0, 1.0),
        target_rate: Sequence[float] | _Array = (0.0, 0.0, 0.0),
        velocity: Sequence[float] | _Array = (0.0, 0.0, 0.0),
        id: str = "scenario",
        bus_attitude: Sequence[float] | _Array | None = None,
        bus_rate: Sequence[float] | _Array | None = None,
        joint_angle: Sequence[float] | _Array | None = None,
        joint_rate: Sequence[float] | _Array | None = None,
        duration_s: float | None = None,
        nodes: int | None = None,
    ) -> Scenario: ...
    @property
    def id(self) -> str:
        """Its name."""

    @property
    def target_attitude(self) -> _Array:
        """The target's attitude at the start, body to RTN, x y z w."""

    @property
    def target_rate(self) -> _Array:
        """Its rate relative to RTN, in its body axes [rad/s]."""

    @property
    def position(self) -> _Array:
        """The system's centre of mass at the start, RTN [m]."""

    @property
    def velocity(self) -> _Array:
        """Its velocity relative to RTN [m/s]."""

    @property
    def duration_s(self) -> float | None:
        """Time to capture [s]; None: the mission's."""

    @property
    def nodes(self) -> int | None:
        """Number of nodes; None: the mission's."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    def _repr_html_(self) -> str: ...
    @staticmethod
    def _of_text(text: str) -> Scenario: ...

@final
class Model:
    """A learned model of a file (`*.model`). It stays in memory until the interpreter ends."""

    def __new__(cls, path: _Path) -> Model: ...
    @property
    def name(self) -> str:
        """Name of the file."""

    @property
    def checksum(self) -> str:
        """CRC-32 of the file's bytes but its own."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[str, bytes]]: ...
    @staticmethod
    def _of_bytes(name: str, bytes: bytes) -> Model: ...

@final
class Scene:
    """An approach after Stage 1: what a guess of Stage 2 is asked with.

    A state is attitude (x y z w), joint angles, rate (RTN) and joint rates in a row, 7 + 2 J numbers.
    """

    @property
    def nodes(self) -> int:
        """Number of nodes."""

    @property
    def joints(self) -> int:
        """Number of the arm's joints."""

    @property
    def dt_s(self) -> float:
        """Time from node to node [s]."""

    @property
    def preset_node(self) -> int:
        """The node from which the joints have their capture angles."""

    @property
    def position(self) -> _Array:
        """The system's centre of mass at the nodes, RTN [m]."""

    @property
    def velocity(self) -> _Array:
        """Its velocity [m/s]."""

    @property
    def force(self) -> _Array:
        """Force over the intervals, RTN [N]."""

    @property
    def target_attitude(self) -> _Array:
        """The target's attitude at the nodes, body to RTN, x y z w."""

    @property
    def target_rate(self) -> _Array:
        """Its rate, RTN [rad/s]."""

    @property
    def torque_limits(self) -> _Array:
        """Largest torques: of the bus, then of the joints [N m]."""

    @property
    def initial_state(self) -> _Array:
        """The state at the first node."""

    def step(self, node: int, state: Sequence[float] | _Array, torques: Sequence[float] | _Array) -> _Array:
        """The state at the next node, torques held from `node` on."""

    def rollout(self, torques: ArrayLike) -> _Array:
        """The states at the nodes that torques, a row an interval, lead through."""

    def features(
        self,
        node: int,
        state: Sequence[float] | _Array,
        held: Sequence[float] | _Array = (),
        encoding: Encoding = "body",
    ) -> NDArray[np.float32]:
        """Features that a network sees at a node: those of the built-in models ("body") or the paper's."""

    def miss(self, state: Sequence[float] | _Array) -> float:
        """Distance of the end effector from the port, were this the state at the last node [m]."""

    def __reduce__(self) -> tuple[Any, tuple[Mission, Scenario, str]]: ...
    @staticmethod
    def _of(mission: Mission, case: Scenario, integrator: Integrator) -> Scene: ...

@final
class Plan:
    """A plan: motion, torques and what the independent verifier says of them."""

    @staticmethod
    def load(path: _Path) -> Plan:
        """Reads a plan file (`*.plan.json`, `*.plan.postcard`), of whatever arm, and has the verifier judge it."""

    def save(self, path: _Path) -> None:
        """Writes the plan file, and its record beside it where there is one; in postcard where the name ends so."""

    @property
    def mission(self) -> Mission:
        """Mission that it was made for."""

    @property
    def scenario(self) -> Scenario:
        """Scenario that it was made for."""

    @property
    def is_verified(self) -> bool:
        """Whether the verifier found every constraint kept, at nodes and between them: it can be flown."""

    @property
    def verdict(self) -> Verdict:
        """ "optimal", "verified_not_converged" or "not_flyable"."""

    @property
    def status(self) -> str:
        """How planning ended."""

    @property
    def start(self) -> Start:
        """Initial guess of Stage 2: "model", "heuristic", "given", "nominal" or "fallback"."""

    @property
    def integrator(self) -> str:
        """ "euler" or "rk4" with its substeps."""

    @property
    def checksum(self) -> str:
        """Checksum of the plan's numbers: 16 hexadecimal digits, the same behind every door."""

    @property
    def residuals(self) -> dict[str, float]:
        """The verifier's residuals by name."""

    @property
    def tolerances(self) -> dict[str, float]:
        """Tolerances of the residuals, by name."""

    @property
    def clearances(self) -> dict[str, float]:
        """Smallest distances of arm and target, bus and target, arm and own bus [m]."""

    @property
    def record(self) -> dict[str, Any] | None:
        """The record that is filed with the plan; None where a loaded file has none beside it."""

    @property
    def iterations(self) -> tuple[int, int]:
        """Iterations of Stage 1 and Stage 2."""

    @property
    def costs(self) -> tuple[float, float]:
        """Costs of Stage 1 and Stage 2."""

    @property
    def times_s(self) -> tuple[float, float, float]:
        """Times of Stage 1, of Stage 2 and of the whole plan, verification included [s]."""

    @property
    def time(self) -> _Array:
        """Times of the nodes [s], shape (N,)."""

    @property
    def position(self) -> _Array:
        """The system's centre of mass at the nodes, RTN [m]."""

    @property
    def velocity(self) -> _Array:
        """Its velocity relative to RTN [m/s]."""

    @property
    def force(self) -> _Array:
        """Force over the intervals, RTN [N]."""

    @property
    def attitude(self) -> _Array:
        """The bus's attitude at the nodes, body to RTN, x y z w."""

    @property
    def joint_angle(self) -> _Array:
        """Joint angles at the nodes [rad]."""

    @property
    def rate(self) -> _Array:
        """The bus's rate relative to RTN, in RTN [rad/s]."""

    @property
    def joint_rate(self) -> _Array:
        """Joint rates at the nodes [rad/s]."""

    @property
    def torques(self) -> _Array:
        """Torques of bus (its axes) and joints over the intervals [N m], shape (N - 1, 3 + J)."""

    @property
    def target_attitude(self) -> _Array:
        """The target's attitude at the nodes, body to RTN, x y z w."""

    @property
    def target_rate(self) -> _Array:
        """Its rate relative to RTN, in RTN [rad/s]."""

    def svg(self, path: _Path | None = None) -> str:
        """The plan as a picture, the text of an SVG file; written to `path` where one is given."""

    def page(self, path: _Path | None = None, *, flights: Sequence[Flight] = ()) -> str:
        """The page of the plan and of flights of it, the text of an HTML file that loads nothing; written to
        `path` where one is given."""

    def show(self, *, flights: Sequence[Flight] = ()) -> None:
        """Shows that page: in a notebook below the cell, otherwise in the browser."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes, bytes | None, Any, bool]]: ...
    def _repr_html_(self) -> str: ...
    @staticmethod
    def _of_packets(file: bytes, evidence: bytes | None, guess: Guess | None, is_judged: bool) -> Plan: ...

@final
class Rows:
    """The rows of a table, to be written."""

    def to_parquet(self, path: _Path) -> None:
        """Writes them as a Parquet file."""

    def to_csv(self, path: _Path) -> None:
        """Writes them as a CSV file."""

    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    @staticmethod
    def _of_text(text: str) -> Rows: ...

@final
class Subproblem:
    """A subproblem with its solver's answer, by nodes and intervals: `docs/reference/plan-file.md` says what it means."""

    @property
    def stage(self) -> int:
        """1 or 2."""

    @property
    def iteration(self) -> int:
        """Which of the stage's iterations, from 1."""

    @property
    def nodes(self) -> int:
        """Number of nodes."""

    @property
    def constant(self) -> float:
        """Constant part of the objective."""

    @property
    def defect_weight(self) -> float:
        """Weight of the L1 norm of the dynamics' slack; infinite where they are hard."""

    @property
    def row_weight(self) -> float:
        """Weight of the soft rows' violation."""

    @property
    def hessian_xx(self) -> _Array:
        """Hessian blocks of the states."""

    @property
    def hessian_ux(self) -> _Array:
        """Cross blocks, a row a control."""

    @property
    def hessian_uu(self) -> _Array:
        """Hessian blocks of the controls."""

    @property
    def gradient_x(self) -> _Array:
        """Linear cost of the states."""

    @property
    def gradient_u(self) -> _Array:
        """Linear cost of the controls."""

    @property
    def lower_x(self) -> _Array:
        """Least states; minus infinity: no bound."""

    @property
    def upper_x(self) -> _Array:
        """Largest states; infinity: no bound."""

    @property
    def lower_u(self) -> _Array:
        """Least controls."""

    @property
    def upper_u(self) -> _Array:
        """Largest controls."""

    @property
    def a(self) -> _Array:
        """Dynamics: `x+ = a x + b u + c + slack`."""

    @property
    def b(self) -> _Array:
        """Dynamics, by control."""

    @property
    def c(self) -> _Array:
        """Dynamics, constant."""

    @property
    def row_x(self) -> _Array:
        """Soft rows: `row_x x + row_offset <= slack`."""

    @property
    def row_offset(self) -> _Array:
        """Soft rows, constant."""

    @property
    def status(self) -> str:
        """The embedded solver's status."""

    @property
    def iterations(self) -> int:
        """Its iterations."""

    @property
    def solution(self) -> dict[str, Any] | None:
        """The solution with its multipliers by the names of the file format; None where there is none."""

    def save(self, path: _Path) -> None:
        """Writes it as a file (`*.qp.json`)."""

    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    @staticmethod
    def _of_bytes(bytes: bytes) -> Subproblem: ...

@final
class Flight:
    """One flight: how it ended, and a row a second of what happened."""

    @property
    def run(self) -> int:
        """Number of the run: errors are drawn from the seed and this."""

    @property
    def ending(self) -> Ending:
        """ "captured", "missed", "collided" or "aborted"."""

    @property
    def is_captured(self) -> bool:
        """Whether the end effector is at the port, as capture demands."""

    @property
    def time_s(self) -> float:
        """When it ended [s]."""

    @property
    def miss_m(self) -> float:
        """Distance of the end effector from the port at the end [m]."""

    @property
    def miss_target_m(self) -> _Array:
        """Position of the end effector from the port at the end, target's axes [m]."""

    @property
    def angle_rad(self) -> float:
        """Angle between the approach axis and the port's at the end [rad]."""

    @property
    def speed_m_s(self) -> float:
        """Speed of the end effector relative to the port at the end [m/s]."""

    @property
    def violations(self) -> list[str]:
        """Limits that were passed, by name."""

    @property
    def room(self) -> dict[str, float | None]:
        """How near it came to limits, by name: the room left, or the share of the limit."""

    @property
    def replans(self) -> tuple[int, int]:
        """Plans made in flight, and how many of them were verified."""

    @property
    def impulse_n_s(self) -> float:
        """Impulse of the commanded force [N s]."""

    @property
    def drawn(self) -> dict[str, float]:
        """Quantities that were drawn, read back from the truth."""

    @property
    def time(self) -> _Array:
        """Times of the rows [s]."""

    @property
    def tip(self) -> _Array:
        """End effector from the port, target's axes [m]."""

    @property
    def joint_angle(self) -> _Array:
        """Joint angles [rad]."""

    @property
    def joint_rate(self) -> _Array:
        """Joint rates [rad/s]."""

    @property
    def force(self) -> _Array:
        """Commanded force, RTN [N]."""

    @property
    def torques(self) -> _Array:
        """Commanded torques of bus (its axes) and joints [N m]."""

    @property
    def tracking(self) -> _Array:
        """Tracking errors: position [m], attitude [rad], the joint farthest off [rad]."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes]]: ...
    def _repr_html_(self) -> str: ...
    @staticmethod
    def _of_bytes(bytes: bytes) -> Flight: ...

@final
class Episodes:
    """Episodes, each on one of the same approaches. A policy's action is torques as shares of their limits."""

    def __new__(
        cls,
        cases: Sequence[Scenario],
        mission: Mission | None,
        *,
        count: int,
        integrator: Integrator,
        encoding: Encoding,
        miss_weight: float,
        jobs: int | None,
    ) -> Episodes: ...
    @property
    def features(self) -> int:
        """Numbers that a policy sees."""

    @property
    def actions(self) -> int:
        """Numbers of an action."""

    @property
    def count(self) -> int:
        """Number of episodes."""

    def begin(self, episode: int, approach: int) -> None:
        """Begins one of them again, on an approach."""

    def observe(self) -> NDArray[np.float32]:
        """Observes all of them."""

    def step(
        self, actions: NDArray[np.float32], begins: NDArray[np.int64] | None = None
    ) -> tuple[NDArray[np.float32], _Array, NDArray[np.bool_]]:
        """Steps all of them, a row of actions an episode. One that has ended stays where it is; one of which
        `begins` names an approach, which is not negative, begins there instead."""

    def misses(self) -> _Array:
        """Distance of the end effectors from their ports, were each at its last node [m]."""

    def costs(self) -> _Array:
        """Costs of the torques so far."""

# Functions behind `remora.functions` and `remora.results`, which give every argument.

def draw(count: int, seed: int, mission: Mission | None) -> list[Scenario]:
    """Draws scenarios, for `remora.draw`."""

def scenarios(path: _Path | None) -> list[Scenario]:
    """Reads scenarios, for `remora.scenarios`."""

def plan(
    case: Scenario,
    mission: Mission | None,
    *,
    integrator: Integrator,
    mode: Mode,
    initial_guess: Guess | None,
    deadline_s: float | None,
) -> Plan:
    """Plans one approach, for `remora.plan`."""

def plan_many(
    cases: Sequence[Scenario],
    mission: Mission | None,
    *,
    integrator: Integrator,
    mode: Mode,
    initial_guess: Guess | None,
    deadline_s: float | None,
    jobs: int | None,
    keep: bool,
) -> tuple[dict[str, NDArray[Any]], Rows, list[Plan | None]]:
    """Plans many approaches, for `remora.plan_many`: columns, rows and, where they are kept, plans."""

def compare_guesses(
    guesses: dict[str, Guess],
    cases: Sequence[Scenario],
    mission: Mission | None,
    *,
    integrator: Integrator,
    mode: Mode,
    jobs: int | None,
) -> dict[str, dict[str, Any]]:
    """Plans the same approaches from each guess, for `remora.compare_guesses`."""

def subproblem(plan: Plan, k: int, *, stage: int) -> Subproblem:
    """Subproblem `k` of a stage of a plan, for `remora.subproblem`."""

def fly(
    plan: Plan,
    *,
    errors: Literal["typical", "none"] | _Path | None,
    seed: int,
    run: int,
    runs: int | None,
    controller: Controller,
    joints: JointControl,
    j2: bool,
    jobs: int | None,
) -> Flight | list[Flight]:
    """Flies a plan, for `remora.fly`; with `runs`, a list of flights."""
