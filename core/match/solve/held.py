"""A solve held to what is known of the scene: survey points, distances, planes, lines, right angles, symmetry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.solve.bundle import adjust
from core.match.solve.constraints import Constraint, Pull, check
from core.match.solve.coordinates import Frame, onto, rows_of, to_frame
from core.match.solve.shot import FLIP
from core.match.solve.solution import Solution
from core.match.solve.state import Array, State, residuals

BENT = 1.15  # of the residuals: what is known and what was tracked do not agree
PLACED = ("survey", "on_plane", "axis")  # kinds whose value is of a world with y up


class Known(NamedTuple):
    """What is known of named tracks: see :class:`core.match.solve.constraints.Constraint`; the world has y up."""

    kind: str
    points: tuple[str, ...]
    value: tuple[float, ...] = ()
    sigma: float = 0.0


def hold(solution: Solution, names: Sequence[str], known: Sequence[Known]) -> Solution:
    """The solve moved by a similarity to where it was measured, then adjusted with what is known as constraints.

    Raises
    ------
    UserError
        A point has no place in the solve, survey points are too few or on one line, or the camera only turns.
    """
    if not known:
        return solution
    if solution.kind == "nodal":
        raise UserError("The camera only turns, so its points have no places that could be held to what was measured.")
    rows = [_constraint(one, solution, names) for one in known]
    for one in rows:
        check(one, len(names))
    state = _placed(solution.state, rows)
    size = float(np.ptp(state.points[solution.held], axis=0).max())
    part = solution.observations.take(solution.used)
    noise = max(solution.sigma, 1e-9)
    pull = Pull(rows, len(names), size)
    missed = pull.misses(state.points)
    state = adjust(
        state, part._replace(root=part.root / noise), solution.free._replace(pull=pull), iterations=60, tolerance=1e-9
    ).state
    sigma = solution.sigma * _length(state, solution) / max(_length(solution.state, solution), 1e-12)
    said = solution.said
    if sigma > BENT * solution.sigma:
        worst = known[int(missed.argmax())]
        said = (*said, (
            f"What is known does not agree with the tracks: holding it raises their error {sigma / solution.sigma:.1f} "
            f"times. Look first at {worst.kind} of {', '.join(worst.points)}."))
    return solution._replace(state=state, sigma=sigma, said=said, free=solution.free._replace(pull=pull))


def _length(state: State, solution: Solution) -> float:
    return float(np.linalg.norm(residuals(state, solution.observations.take(solution.used))))


def _constraint(one: Known, solution: Solution, names: Sequence[str]) -> Constraint:
    rows = rows_of(names, one.points)
    lost = [names[k] for k in rows if not solution.held[k]]
    if lost:
        raise UserError(f"Track {lost[0]} is known to lie somewhere but has no place in the solve; track it better.")
    value: Array = np.array(one.value, np.float64)
    if one.kind in PLACED and len(value) >= 3:
        value[:3] = FLIP @ value[:3]
    return Constraint(one.kind, tuple(rows), tuple(float(v) for v in value), one.sigma)


def _placed(state: State, rows: Sequence[Constraint]) -> State:
    """Where and how large it was measured, as far as a similarity can."""
    survey = [one for one in rows if one.kind == "survey"]
    if survey:
        places = np.array([one.value for one in survey])
        return onto(state.points[[one.points[0] for one in survey]], places).state(state)
    length = next((one for one in rows if one.kind == "distance"), None)
    if length is None:
        return state
    i, j = length.points
    return to_frame(Frame(distance=(i, j, length.value[0])), state.points).state(state)
