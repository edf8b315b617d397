"""Which hairs and guides are worth drawing: those shown, on the side of the skin that is turned to the viewer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, pixel_scale
from viewport.scene import Coat, GuideLines

AWAY = -0.35  # cosine between skin and the way to the eye below which hair is hidden by what it grows on
TURNING_POINTS, MOST_TURNING = 5, 700  # of a guide, and guides of a groom, while the camera moves
FEWEST_POINTS, MOST_POINTS = 4, 8  # of a hair while the hand moves
MOST_COVER = 0.7  # of the picture, all hairs side by side: what filling them may cost
BLUNT = 0.6  # of its root the least width of the tip of a ribbon that stands for several hairs
PIXELS_A_PIECE = 7.0  # of a hair of usual length
WIDER = 0.65  # exponent: fewer hairs are wider, between what keeps one hair's look and what keeps all of the cover


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


def stands_for(coat: Coat, hairs: int) -> float:
    """How many hairs of the coat each of those taken by :func:`prefix_rows` stands for, at least 1."""
    shown = len(coat.points) if coat.order is None else len(coat.order)
    return max(shown / max(len(prefix_rows(coat, hairs)), 1), 1.0)


def sparse_coat(coat: Coat, camera: Camera, hairs: int, size: tuple[int, int]) -> Coat:
    """The near side of an even part of a coat, gathered, with fewer points and wider hairs.

    hairs : how many of the coat are taken before those on the far side are left out.
    size : of the picture, pixels; long hairs get more points, and all hairs together are not widened to cover more
        than MOST_COVER of it.
    `order` of the result holds the rows of the coat that were taken.
    """
    rows = prefix_rows(coat, hairs)
    wider = stands_for(coat, hairs) ** WIDER
    roots = roots_of(coat.points)[rows]
    near = turned_to(camera, roots, coat.normals[rows])
    rows, roots = rows[near], roots[near]
    look, count = coat.look, MOST_POINTS
    if len(rows):
        last = coat.points[rows, :, -1] if coat.points.shape[1] == 3 else coat.points[rows, -1]
        away = 1.0 if camera.orthographic else max(float(np.median((roots - camera.position) @ camera.forward)), 1e-9)
        scale = pixel_scale(camera, size[1]) / away
        long = float(np.median(np.linalg.norm(last - roots, axis=1))) * scale
        count = int(np.clip(np.ceil(long / PIXELS_A_PIECE) + 1, FEWEST_POINTS, MOST_POINTS))
        most = MOST_COVER * size[0] * size[1] / max(len(rows) * long * look.root_width * scale, 1e-9)
        wider = max(min(wider, most), 1.0)
    root, tip = look.root_width * wider, look.tip_width * wider
    if wider > 1.0:
        tip = max(tip, BLUNT * root)
    return Coat(
        fewer_points(coat.points, rows, count), np.asarray(coat.ids)[rows], coat.normals[rows],
        look._replace(root_width=root, tip_width=tip), None if coat.tints is None else coat.tints[rows],
        None if coat.widths is None else coat.widths[rows], rows,
    )


def sparse_points(coat: Coat, drawn: Coat) -> Coat:
    """A coat made by :func:`sparse_coat`, with the points that `coat` has now."""
    assert drawn.order is not None
    count = drawn.points.shape[2] if coat.points.shape[1] == 3 else drawn.points.shape[1]
    return drawn._replace(points=fewer_points(coat.points, drawn.order, count))


def fewer_points(points: np.ndarray, rows: NDArray[np.integer], count: int) -> NDArray[np.float32]:
    """These rows of strands in their layout, with at most `count` of their points, first and last among them."""
    by_axis = points.shape[1] == 3
    have = points.shape[2] if by_axis else points.shape[1]
    gathered = points[rows]
    if count < have:
        at = np.rint(np.linspace(0, have - 1, count)).astype(np.intp)
        gathered = gathered[:, :, at] if by_axis else gathered[:, at]
    return np.ascontiguousarray(gathered, np.float32)


def near_guides(lines: GuideLines, camera: Camera, turning: bool = False) -> GuideLines:
    """The guides on the near side, gathered, with at most MOST_POINTS points.

    turning : the camera moves: an even part of them, at most MOST_TURNING, with at most TURNING_POINTS.
    """
    rows = shown_rows(lines, camera, near_only=True)
    rows = np.arange(len(lines.points)) if rows is None else rows
    count = TURNING_POINTS if turning else MOST_POINTS
    if turning:
        rows = rows[:: -(-len(rows) // MOST_TURNING) or 1]
    return lines._replace(
        points=fewer_points(lines.points, rows, count), states=lines.states[rows],
        normals=None if lines.normals is None else lines.normals[rows],
    )
