"""Whether more than one motion may be among the tracks: what no residual of the tracks that fit can say.

A thing that moves by itself before a camera that only turns looks like a still thing before a camera that moves, with
all else infinitely far; and the camera that more tracks agree on is one of the thing where the thing has more of them.
"""

from __future__ import annotations

import numpy as np

from core.match.solve.floor import noise_floor
from core.match.solve.solution import Solution
from core.match.solve.state import Flags, residuals

PARALLAX = 30.0  # variances by which the squares of a track rise at an infinite distance: it is told to be near
FAR = 0.5  # share of the tracks that are told by no parallax: the path hangs on the others
TOGETHER = 10  # tracks whose noise can be told without a camera
LEFT_OUT = 0.15  # share of the tracks; fewer are some bad ones
SMOOTH = 2.0  # of the noise of all tracks: they do not jump about by themselves
AWAY = 20.0  # standard deviations: no slow slide goes so far


def without_parallax(solution: Solution) -> Flags:
    """(P,) tracks that have a point and fit as well where that is infinitely far, in its own direction."""
    state, part = solution.state, solution.observations.take(solution.used)
    count = len(solution.held)
    seen = np.bincount(part.track, minlength=count)
    centres = state.centres()[part.frame]
    middle = np.stack([np.bincount(part.track, weights=axis, minlength=count) for axis in centres.T], axis=1)
    way = state.points - middle / np.maximum(seen, 1)[:, None]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-30)
    away = state._replace(points=way, translation=np.zeros_like(state.translation))
    squares = []
    for one in (state, away):  # a shift in the picture is another direction
        error = residuals(one, part)
        whole = np.bincount(part.track, weights=(error**2).sum(axis=1), minlength=count)
        mean = [np.bincount(part.track, weights=axis, minlength=count) for axis in error.T]
        squares.append(whole - (mean[0] ** 2 + mean[1] ** 2) / np.maximum(seen, 1))
    rise = (squares[1] - squares[0]) / max(solution.sigma, 1e-12) ** 2
    return np.asarray(solution.held & (seen >= 2) & (rise < PARALLAX))


def of_their_own(solution: Solution) -> Flags:
    """(P,) tracks that were left out though they are as quiet as the others, and far from where the camera has them;
    none where that are few."""
    rows, count = solution.observations, len(solution.held)
    seen = np.bincount(rows.track, minlength=count)
    left = ~solution.held & (seen >= 2)
    nothing = np.zeros(count, bool)
    if left.sum() < max(TOGETHER, LEFT_OUT * (seen >= 2).sum()):
        return nothing
    out = rows.take(left[rows.track])
    pixels = solution.noise / float(np.median(rows.root[:, 0]))
    floor = noise_floor(out, len(solution.frames))
    if floor is None or floor > SMOOTH * pixels:
        return nothing
    there = solution.known[out.frame]
    error = np.nan_to_num((residuals(solution.state, out) ** 2).sum(axis=1), nan=np.inf, posinf=1e30)[there]
    mean = np.bincount(out.track[there], weights=error, minlength=count) / np.maximum(
        np.bincount(out.track[there], minlength=count), 1
    )
    away = left & (mean > 2.0 * (AWAY * solution.sigma) ** 2)
    return away if away.sum() >= TOGETHER else nothing


def told_of_motions(solution: Solution) -> list[str]:
    """Words about motions that may be taken for that of the camera."""
    said = []
    if solution.kind == "free" and not solution.views.alone.any():
        far = int(without_parallax(solution).sum())
        held = int(solution.held.sum())
        if far < held and far >= FAR * held:
            said.append(
                f"The path is told by {held - far} tracks alone, the other {far} are as good as infinitely far: if "
                "those few lie on something that moves by itself, take them out, and the camera only turns (--nodal)."
            )
    own = of_their_own(solution)
    if own.any():
        share = own.sum() / max(1, len(np.unique(solution.observations.track)))
        said.append(
            f"{int(own.sum())} tracks that were left out ({round(100 * share)} %) move by themselves, steadily: there "
            "are two motions, and the path is that of the one with more tracks. If that is not the set, take those "
            "out instead."
        )
    return said
