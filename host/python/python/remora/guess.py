"""What Stage 2 may be told to start from."""

from collections.abc import Callable
from typing import Literal, TypeAlias, Union

from numpy.typing import ArrayLike

from remora._remora import Model, Plan, Scene

#: "model" (the built-in one), "heuristic", a model of a file, a plan, a plan so many seconds after its start,
#: torques of shape (nodes - 1, 3 + joints), or a function that answers torques.
Guess: TypeAlias = Union[
    Literal["model", "heuristic"], Model, Plan, tuple[Plan, float], ArrayLike, Callable[[Scene], ArrayLike]
]
