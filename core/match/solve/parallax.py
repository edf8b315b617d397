"""Angles under which points are seen: what tells how far they are."""

from __future__ import annotations

import numpy as np

from core.match.solve.solution import Solution
from core.match.solve.state import Array


def parallax_degrees(solution: Solution) -> Array:
    """(P,) the angle between the directions from the first and the last camera that used a point, the largest with the
    one between, in degrees; NaN of a point that has no place."""
    state, rows = solution.state, solution.observations
    centres = state.centres()
    found = np.full(len(solution.held), np.nan)
    frame, track = rows.frame[solution.used], rows.track[solution.used]
    order = np.lexsort((frame, track))
    frame, track = frame[order], track[order]
    starts = np.flatnonzero(np.r_[True, track[1:] != track[:-1]]) if len(track) else np.zeros(0, int)
    ends = np.r_[starts[1:], len(track)] - 1
    for start, end in zip(starts, ends, strict=True):
        seen = centres[frame[[start, (start + end) // 2, end]]] - state.points[track[start]]
        unit = seen / np.maximum(np.linalg.norm(seen, axis=1, keepdims=True), 1e-12)
        found[track[start]] = np.degrees(np.arccos(np.clip((unit @ unit.T).min(), -1.0, 1.0)))
    return found
