"""Names that arguments and results may have."""

from typing import Literal, TypeAlias, Union

#: Discretisation of Stage 2; "rk4:4" takes four substeps per interval.
Integrator: TypeAlias = Union[Literal["rk4", "euler"], str]

#: Goal of planning.
Mode: TypeAlias = Literal["optimal", "feasible"]

#: Verdict on a plan.
Verdict: TypeAlias = Literal["optimal", "verified_not_converged", "not_flyable"]

#: Initial guess of Stage 2.
Start: TypeAlias = Literal["model", "heuristic", "given", "nominal", "fallback"]

#: Controller of a flight.
Controller: TypeAlias = Literal["track", "replan"]

#: Drive of the joints.
JointControl: TypeAlias = Literal["torque", "servo"]

#: End of a flight.
Ending: TypeAlias = Literal["captured", "missed", "collided", "aborted"]

#: Inputs of a network.
Encoding: TypeAlias = Literal["body", "paper", "servicer"]
