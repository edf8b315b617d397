"""The frame of a solve: where its origin is, what is up, how large it is. A similarity, which never bends anything."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.solve.state import Array, State

LEAST = 1e-9  # of the size of the scene: shorter directions say nothing


class Similarity(NamedTuple):
    """``X_new = scale * turn @ X + shift``."""

    scale: float
    turn: Array
    shift: Array

    def points(self, points: Array) -> Array:
        """Points (N, 3) in the new frame."""
        return self.scale * points @ self.turn.T + self.shift

    def state(self, state: State) -> State:
        """Cameras and points in the new frame; pictures of them stay what they are."""
        rotation = state.rotation @ self.turn.T
        translation = self.scale * state.translation - rotation @ self.shift
        return state._replace(
            rotation=np.ascontiguousarray(rotation), translation=translation, points=self.points(state.points)
        )


class Frame(NamedTuple):
    """What an artist says of the frame. Each is of rows of points; None where nothing is said.

    origin : the point at the origin. axis : two points along +x. plane : three or more points of the ground, whose
    normal is +y. distance : two points and how far they are apart.
    """

    origin: int | None = None
    axis: tuple[int, int] | None = None
    plane: tuple[int, ...] | None = None
    distance: tuple[int, int, float] | None = None


def to_frame(frame: Frame, points: Array, up: Array | None = None) -> Similarity:
    """The similarity that brings points (P, 3) into a frame.

    up : (3,) what is up so far, which side of the plane is above; the mean of the cameras less that of the points.

    Raises
    ------
    UserError
        Points of an axis or of a distance lie at one place, those of a plane on one line.
    """
    scale = 1.0
    size = float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0
    if frame.distance is not None:
        i, j, wanted = frame.distance
        length = float(np.linalg.norm(points[j] - points[i]))
        if length < LEAST * size or not wanted > 0.0:
            raise UserError("The distance needs two points at different places and a length above 0.")
        scale = wanted / length
    turn = np.eye(3)
    if frame.plane is not None:
        turn = _level(points[list(frame.plane)], size, up)
    if frame.axis is not None:
        way = turn @ (points[frame.axis[1]] - points[frame.axis[0]])
        if frame.plane is not None:
            way[1] = 0.0
        if np.linalg.norm(way) < LEAST * size:
            raise UserError("The axis needs two points at different places, one not above the other.")
        turn = _turn(way / np.linalg.norm(way), np.array([1.0, 0.0, 0.0])) @ turn
    middle = points[frame.origin] if frame.origin is not None else np.zeros(3)
    return Similarity(scale, turn, -scale * turn @ middle)


def _level(points: Array, size: float, up: Array | None) -> Array:
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0))
    if len(points) < 3 or spread[1] < LEAST * size:
        raise UserError("The ground needs three points that are not on one line.")
    normal = axes[2]
    if up is not None and normal @ up < 0.0:
        normal = -normal
    return _turn(normal, np.array([0.0, 1.0, 0.0]))


def _turn(a: Array, b: Array) -> Array:
    """The least rotation that brings unit a onto unit b."""
    cosine = float(a @ b)
    if cosine < -1.0 + 1e-12:
        side = np.linalg.svd(a[None])[2][1]
        return np.asarray(2.0 * np.outer(side, side) - np.eye(3))
    across = np.cross(a, b)
    skew = np.cross(np.eye(3), across)  # skew @ v is across x v
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine))


def onto(points: Array, places: Array, weight: Array | None = None) -> Similarity:
    """The similarity that brings points (N, 3) nearest to places (N, 3).

    (Umeyama, "Least-squares estimation of transformation parameters between two point patterns", 1991.)

    Raises
    ------
    UserError
        There are fewer than three points, or they lie on one line.
    """
    share = np.ones(len(points)) if weight is None else weight
    if len(points) < 3:
        raise UserError("Three points whose places were measured are needed at least, not on one line.")
    share = share / share.sum()
    middle, goal = share @ points, share @ places
    a, b = points - middle, places - goal
    u, s, vt = np.linalg.svd((b * share[:, None]).T @ a)
    if s[1] < 1e-9 * max(s[0], 1e-30):
        raise UserError("The points whose places were measured lie on one line; measure one beside it.")
    flip = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ vt)))])
    turn = u @ flip @ vt
    scale = float(np.trace(np.diag(s) @ flip)) / max(float((share[:, None] * a**2).sum()), 1e-30)
    return Similarity(scale, turn, goal - scale * turn @ middle)


def rows_of(names: Sequence[str], wanted: Sequence[str]) -> list[int]:
    """Rows of named points; UserError when one is not among `names`."""
    place = {name: k for k, name in enumerate(names)}
    missing = [name for name in wanted if name not in place]
    if missing:
        raise UserError(f"There is no point {missing[0]!r} in this solve; there are {', '.join(list(names)[:8])} ...")
    return [place[name] for name in wanted]
