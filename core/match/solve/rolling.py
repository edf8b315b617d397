"""Rolling shutter: rows of a picture are taken one after another, while the camera moves on.

A row is taken `readout * (y / height - 1/2)` frames after the middle of its picture. Each observation is brought to the
middle by the path its point takes in the picture, a parabola through the frames before and after, and all is solved
again. (Forssén and Ringaby, "Rectifying Video Sequences from Rolling Shutter Cameras", 2010, section 3, with the motion
taken from the solve.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.solve.bundle import Free, adjust
from core.match.solve.state import Array, Flags, Observations, Rows, State, projected

APART = 0.3  # of a frame, between readouts that are compared
MOST = 1.5  # of a frame; what reads slower is no camera
NEAR = 20.0  # pixels an observation may miss by and still be said to move as its point does


class Motion(NamedTuple):
    """How points move in the picture about the middle of a frame: pixels a frame and a frame squared, (N, 2) each, 0
    where it is not known. row : (N,) -1/2 to 1/2 of the height."""

    pace: Array
    bend: Array
    row: Array


def motion(state: State, observations: Observations, frames: Rows, height: int, known: Flags) -> Motion:
    """Of the points of a solve; frames (F,) their numbers, known (F,) those that have a camera."""
    here, front = projected(state, observations.frame, state.points[observations.track])
    solved = known[observations.frame] & (front > 1e-9)
    solved &= np.linalg.norm(here - observations.xy, axis=1) < NEAR
    moved = []
    for step in (-1, 1):
        other = np.clip(observations.frame + step, 0, len(frames) - 1)
        there, depth = projected(state, other, state.points[observations.track])
        time = (frames[other] - frames[observations.frame]).astype(np.float64)
        moved.append((there - here, time, (time != 0.0) & (depth > 1e-9) & known[other]))
    (back, before, has_back), (ahead, after, has_ahead) = moved
    # a parabola where both neighbours are there, a line through the one that is
    both = has_back & has_ahead
    safe = [np.where(has, time, 1.0)[:, None] for has, time in ((has_back, before), (has_ahead, after))]
    slopes = back / safe[0], ahead / safe[1]
    bend = np.where(both[:, None], (slopes[1] - slopes[0]) / np.where(both, after - before, 1.0)[:, None], 0.0)
    pace = np.where(
        both[:, None], slopes[0] - bend * before[:, None], np.where(has_ahead[:, None], slopes[1], slopes[0]))
    solved &= has_back | has_ahead
    row = (observations.xy[:, 1] + 0.5) / height - 0.5
    return Motion(np.where(solved[:, None], pace, 0.0), np.where(solved[:, None], bend, 0.0), row)


def unrolled(observations: Observations, moving: Motion, readout: float) -> Observations:
    """Where the points were in the middle of each picture; `readout` is the share of a frame all rows take."""
    late = (readout * moving.row)[:, None]
    return observations._replace(xy=np.ascontiguousarray(observations.xy - late * (moving.pace + late * moving.bend)))


def found_readout(
    state: State, observations: Observations, moving: Motion, free: Free, readout: float, sigma: float
) -> tuple[float, float]:
    """The readout that explains the observations best and its standard deviation, by the parabola through the squares
    at three of them, each with all else adjusted. sigma : of the whitened residuals of an axis."""
    costs = [
        adjust(state, unrolled(observations, moving, readout + step), free, iterations=8, tolerance=1e-6).cost
        for step in (-APART, 0.0, APART)
    ]
    slope = 0.5 * (costs[2] - costs[0]) / APART
    curve = (costs[0] - 2.0 * costs[1] + costs[2]) / APART**2
    if curve <= 1e-6 * costs[1]:
        raise UserError("The readout of the shutter cannot be told from these tracks: the picture moves too little.")
    return float(np.clip(readout - slope / curve, -MOST, MOST)), float(sigma * np.sqrt(2.0 / curve))
