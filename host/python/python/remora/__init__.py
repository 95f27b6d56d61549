"""Plans the last twenty minutes before a servicer satellite catches a tumbling one with its robot arm.

    >>> import remora
    >>> case = remora.draw(1, seed=1)[0]
    >>> plan = remora.plan(case)
    >>> plan.is_verified
    True

Angles are radians, lengths metres, forces newtons; quaternions are x, y, z, w; RTN is the target's orbital
frame. Every function may be called on any thread, lets others run while it plans, and answers Ctrl-C within a
second. Everything pickles.
"""

from remora._remora import (
    Flight,
    Mission,
    Model,
    Plan,
    Refused,
    Scenario,
    Scene,
    Subproblem,
    __version__,
)
from remora.functions import draw, fly, plan, scenarios, subproblem
from remora.guess import Guess
from remora.results import Comparison, Flights, Table, compare_guesses, plan_many

__all__ = [
    "Comparison",
    "Flight",
    "Flights",
    "Guess",
    "Mission",
    "Model",
    "Plan",
    "Refused",
    "Scenario",
    "Scene",
    "Subproblem",
    "Table",
    "__version__",
    "compare_guesses",
    "draw",
    "fly",
    "plan",
    "plan_many",
    "scenarios",
    "subproblem",
]
