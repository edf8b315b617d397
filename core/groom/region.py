"""What a brush reaches: who may be edited, how much of it lies under a ring, on which side of a line it stands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from core.falloff import Shape, falloff
from core.groom.guides import Guides


class View(NamedTuple):
    """How the artist looks at the groom. Pixel centres lie at whole numbers, origin top left.

    clip_from_object : (4, 4) float64, perspective or orthographic, OpenGL clip space.
    width, height : pixels of the picture.
    """

    clip_from_object: NDArray[np.float64]
    width: int
    height: int

    def pixels(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pixels (..., 2) and clip w (...) of object-space points (..., 3); w <= 0 lies behind the eye."""
        p = np.asarray(points, np.float64)
        m = np.asarray(self.clip_from_object, np.float64)
        # one product of two matrices: a stack of small ones takes five times as long
        clip = (p.reshape(-1, 3) @ m[:, :3].T + m[:, 3]).reshape(*p.shape[:-1], 4)
        w = clip[..., 3]
        safe = np.where(np.abs(w) < 1e-12, 1e-12, w)
        x = 0.5 * self.width * (1.0 + clip[..., 0] / safe) - 0.5
        y = 0.5 * self.height * (1.0 - clip[..., 1] / safe) - 0.5
        return np.stack([x, y], axis=-1), w

    def motion_basis(self) -> NDArray[np.float64]:
        """(3, 2): object-space motion in the plane of the screen per unit of clip x / w and y / w, at w = 1."""
        m = np.asarray(self.clip_from_object, np.float64)
        # Along the screen w (perspective) or, where w is constant, depth does not change.
        across = m[3, :3] if np.abs(m[3, :3]).max() > 1e-12 else m[2, :3]
        return np.ascontiguousarray(np.linalg.inv(np.stack([m[0, :3], m[1, :3], across]))[:, :2])

    def toward_eye(self, points: ArrayLike) -> NDArray[np.float64]:
        """Unit vectors (..., 3) from object-space points to the eye."""
        p = np.asarray(points, np.float64)
        m = np.asarray(self.clip_from_object, np.float64)
        if np.abs(m[3, :3]).max() > 1e-12:
            eye = np.linalg.solve(m[[0, 1, 3], :3], -m[[0, 1, 3], 3])
            d = eye - p
        else:
            back = np.cross(m[0, :3], m[1, :3])
            if float(back @ m[2, :3]) > 0.0:  # depth grows away from the eye
                back = -back
            d = np.broadcast_to(back, p.shape)
        return d / np.maximum(np.linalg.norm(d, axis=-1, keepdims=True), 1e-300)


def editable(guides: Guides) -> NDArray[np.bool_]:
    """(G,) bool: not frozen and, where any guide is selected, selected."""
    free = ~guides.frozen
    return free & guides.selected if guides.selected.any() else free


def segment_freedom(hold: NDArray[np.float32]) -> NDArray[np.float64]:
    """(G, P - 1): how far each segment may turn; as free as the stiffest point that it carries."""
    return 1.0 - np.maximum.accumulate(hold[:, :0:-1].astype(np.float64), axis=1)[:, ::-1]


def strand_freedom(hold: NDArray[np.float32]) -> NDArray[np.float64]:
    """(G,): how far a whole strand may change (its length, its place): as free as its stiffest point."""
    return 1.0 - hold.max(axis=1, initial=0.0).astype(np.float64)


def distance_to_path(pixels: NDArray[np.float64], path: ArrayLike) -> NDArray[np.float64]:
    """Distance of points (..., 2) to a polyline (K, 2), K >= 1."""
    p = np.asarray(path, np.float64).reshape(-1, 2)
    starts, ends = (p, p) if len(p) == 1 else (p[:-1], p[1:])
    best = np.full(pixels.shape[:-1], np.inf)
    for a, b in zip(starts, ends):
        ab = b - a
        t = np.clip(((pixels - a) @ ab) / max(float(ab @ ab), 1e-300), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(pixels - a - t[..., None] * ab, axis=-1))
    return best


def screen_weights(
    points: ArrayLike, view: View, path: ArrayLike, radius: float, shape: Shape = "smooth", flat: float = 0.25
) -> NDArray[np.float64]:
    """Weights 0 .. 1 of points (..., 3) under a ring of `radius` pixels dragged along `path` (K, 2) pixels."""
    pixels, w = view.pixels(points)
    weights = falloff(distance_to_path(pixels, path) / max(radius, 1e-9), shape, flat)
    return np.where(w > 0.0, weights, 0.0)


def world_weights(
    points: ArrayLike, centre: ArrayLike, radius: float, shape: Shape = "smooth", flat: float = 0.25
) -> NDArray[np.float64]:
    """Weights 0 .. 1 of points (..., 3) in a ball of `radius` metres about `centre` (3,)."""
    d = np.linalg.norm(np.asarray(points, np.float64) - np.asarray(centre, np.float64), axis=-1)
    return falloff(d / max(radius, 1e-12), shape, flat)


def facing(guides: Guides, view: View, threshold: float = -0.1) -> NDArray[np.bool_]:
    """(G,) bool: roots whose skin faces the eye (cosine above `threshold`), so that a brush spares the far side."""
    toward = view.toward_eye(guides.points[:, 0])
    return np.einsum("ij,ij->i", toward, guides.roots.frames[:, 2].astype(np.float64)) > threshold


def inside_polygon(pixels: NDArray[np.float64], polygon: ArrayLike) -> NDArray[np.bool_]:
    """(...) bool: points (..., 2) inside a closed polygon (K, 2), even-odd rule."""
    p = np.asarray(polygon, np.float64).reshape(-1, 2)
    x, y = pixels[..., 0], pixels[..., 1]
    inside = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(p, np.roll(p, -1, axis=0)):
        crosses = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = (bx - ax) * (y - ay) / (by - ay) + ax
        inside ^= crosses & (x < at)
    return inside


def side_of_line(guides: Guides, view: View, line: ArrayLike) -> NDArray[np.int8]:
    """(G,) int8, -1 or 1: on which side of a drawn line (K, 2) pixels each root stands (a parting masks by it)."""
    pixels, _ = view.pixels(guides.points[:, 0])
    p = np.asarray(line, np.float64).reshape(-1, 2)
    if len(p) < 2:
        return np.ones(len(guides), np.int8)
    best = np.full(len(guides), np.inf)
    side = np.ones(len(guides))
    last = len(p) - 2
    for i in range(last + 1):
        a, ab = p[i], p[i + 1] - p[i]
        t = (pixels - a) @ ab / max(float(ab @ ab), 1e-300)
        # the end pieces go on for ever, so that the line divides the whole picture
        t = np.clip(t, -np.inf if i == 0 else 0.0, np.inf if i == last else 1.0)
        offset = pixels - a - t[:, None] * ab
        d = np.linalg.norm(offset, axis=1)
        cross = ab[0] * (pixels[:, 1] - a[1]) - ab[1] * (pixels[:, 0] - a[0])
        nearer = d < best
        best = np.where(nearer, d, best)
        side = np.where(nearer, np.where(cross < 0.0, -1.0, 1.0), side)
    return side.astype(np.int8)


def neighbours(roots: NDArray[np.float32], count: int = 6) -> NDArray[np.int64]:
    """(G, k) rows of the nearest other roots, k = min(count, G - 1)."""
    k = max(0, min(count, len(roots) - 1))
    if k == 0:
        return np.zeros((len(roots), 0), np.int64)
    found = cKDTree(roots.astype(np.float64)).query(roots.astype(np.float64), k=k + 1)[1]
    # each row without itself; coincident roots may list another first, then the last one is dropped
    own = found == np.arange(len(roots))[:, None]
    own[~own.any(axis=1), -1] = True
    return found[~own].reshape(len(roots), k).astype(np.int64)
