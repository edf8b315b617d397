"""Which hairs and guides are worth drawing: those shown, on the side of the skin that is turned to the viewer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from viewport.scene import Coat, GuideLines

AWAY = -0.35  # cosine between skin and the way to the eye below which hair is hidden by what it grows on
FEWEST_POINTS, MOST_POINTS = 5, 8  # of a hair while the hand moves
WIDER = 0.75  # exponent: fewer hairs are wider, between what keeps one hair's look and what keeps all of the cover


def shown_rows(strands: Coat | GuideLines, camera: Camera, near_only: bool) -> NDArray[np.integer] | None:
    """Rows that are drawn, None for all; `near_only` leaves out those on the far side, where normals are known."""
    order = strands.order if isinstance(strands, Coat) else None
    if not near_only or strands.normals is None or len(strands.points) == 0:
        return order
    rows = np.arange(len(strands.points), dtype=np.int32) if order is None else order
    return rows[turned_to(camera, roots_of(strands.points)[rows], strands.normals[rows])]


def roots_of(points: np.ndarray) -> np.ndarray:
    """(N, 3), a view of the first points of strands (N, 3, P) or (N, P, 3)."""
    return points[:, :, 0] if points.shape[1] == 3 else points[:, 0, :]


def turned_to(camera: Camera, roots: np.ndarray, normals: np.ndarray) -> NDArray[np.bool_]:
    """(N,) True where skin with these normals at these places is turned to the camera, or hardly away from it."""
    if camera.orthographic:
        facing = normals @ (-camera.forward).astype(np.float32)
        return np.asarray(facing > AWAY)
    to_eye = camera.position.astype(np.float32) - roots
    facing = np.einsum("nc,nc->n", normals, to_eye)
    return np.asarray(facing > AWAY * np.sqrt(np.einsum("nc,nc->n", to_eye, to_eye)))


def prefix_rows(coat: Coat, hairs: int) -> NDArray[np.integer]:
    """Rows of an even part of the coat with at most `hairs` hairs."""
    if coat.order is not None:
        return coat.order[:hairs]
    return np.arange(0, len(coat.points), -(-len(coat.points) // max(hairs, 1)) or 1, dtype=np.int32)


def sparse_coat(coat: Coat, camera: Camera, hairs: int, points: int | None = None) -> Coat:
    """The near side of an even part of a coat, gathered, with fewer points and wider hairs.

    hairs : how many of the coat are taken before those on the far side are left out.
    points : of each hair, all by default.
    """
    rows = prefix_rows(coat, hairs)
    shown = len(coat.points) if coat.order is None else len(coat.order)
    wider = (shown / max(len(rows), 1)) ** WIDER
    rows = rows[turned_to(camera, roots_of(coat.points)[rows], coat.normals[rows])]
    look = coat.look._replace(root_width=coat.look.root_width * wider, tip_width=coat.look.tip_width * wider)
    return Coat(
        fewer_points(coat.points, rows, points), np.asarray(coat.ids)[rows], coat.normals[rows], look,
        None if coat.tints is None else coat.tints[rows], None if coat.widths is None else coat.widths[rows],
    )


def fewer_points(points: np.ndarray, rows: NDArray[np.integer], count: int | None) -> NDArray[np.float32]:
    """These rows of strands in their layout, with `count` of their points, first and last among them."""
    by_axis = points.shape[1] == 3
    have = points.shape[2] if by_axis else points.shape[1]
    gathered = points[rows]
    if count is not None and count < have:
        at = np.rint(np.linspace(0, have - 1, count)).astype(np.intp)
        gathered = gathered[:, :, at] if by_axis else gathered[:, at]
    return np.ascontiguousarray(gathered, np.float32)


def near_guides(lines: GuideLines, camera: Camera) -> GuideLines:
    """The guides on the near side, gathered, with at most MOST_POINTS points."""
    rows = shown_rows(lines, camera, near_only=True)
    rows = np.arange(len(lines.points)) if rows is None else rows
    return lines._replace(
        points=fewer_points(lines.points, rows, MOST_POINTS), states=lines.states[rows],
        normals=None if lines.normals is None else lines.normals[rows],
    )
