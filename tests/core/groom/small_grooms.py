"""Small skins and grooms that tests of the kernels share."""

from __future__ import annotations

import functools

import numpy as np
import trimesh
from numpy.typing import NDArray

from core.camera import Camera, clip_from_world, look_at
from core.evaluator import Evaluator
from core.groom.commands import SkinContext, skin_context
from core.groom.guides import Guides
from core.groom.plant import plant_scatter
from core.groom.region import View
from core.groom.rows import no_guides
from core.mesh.mesh import Mesh
from core.record import freeze


def mesh_of(points: NDArray, triangles: NDArray) -> Mesh:
    return Mesh(
        points=np.asarray(points, np.float32), counts=np.full(len(triangles), 3, np.int32),
        corners=np.asarray(triangles, np.int32).ravel(), parts=np.zeros(len(triangles), np.int32), part_names=("skin",),
    )


@functools.cache
def ball(bump: float = 0.0, subdivisions: int = 3) -> SkinContext:
    """A sphere of radius 1, symmetric in x, with bumps of height `bump`."""
    m = trimesh.creation.icosphere(subdivisions, 1.0)
    p = np.asarray(m.vertices)
    p = p * (1.0 + bump * np.cos(7.0 * p[:, :1]) * np.sin(6.0 * p[:, 1:2] + 1.0) * np.cos(5.0 * p[:, 2:]))
    return skin_context(mesh_of(p, m.faces), Evaluator())


@functools.cache
def fur(count: int = 60, length: float = 0.4, bump: float = 0.0, points: int = 12, seed: int = 1) -> Guides:
    """Straight guides scattered over the ball."""
    return plant_scatter(no_guides(points), ball(bump).skin, count, seed=seed, length=length)


def mixed(seed: int, guides: Guides | None = None) -> Guides:
    """Fur some of which is frozen, selected, held at the root or all over, and bent at random."""
    rng = np.random.default_rng(seed)
    g = fur() if guides is None else guides
    n, p = g.hold.shape
    hold = np.where(rng.random((n, 1)) < 0.5, rng.random((n, p)) * rng.random((n, 1)), 0.0)
    hold[rng.random(n) < 0.2] = 1.0
    locked = rng.random(n) < 0.2
    hold[locked, : p // 2] = 1.0
    hold[rng.random(n) < 0.15, p // 3] = 1.0  # what stands below a locked point is locked with it
    selected = (rng.random(n) < 0.6) & bool(rng.integers(2))
    return g.replace(
        hold=freeze(hold.astype(np.float32)), frozen=freeze(rng.random(n) < 0.2), selected=freeze(selected))


def view(direction: tuple[float, float, float] = (0.0, 0.0, -1.0), orthographic: bool = True) -> View:
    """The ball from 6 metres away, 400 pixels."""
    d = np.asarray(direction, np.float64)
    eye = -6.0 * d / np.linalg.norm(d)
    camera = Camera(world_from_camera=look_at(eye, np.zeros(3)), orthographic=orthographic, height=3.6)
    return View(clip_from_world(camera, 400, 400), 400, 400)


def segment_lengths(guides: Guides) -> NDArray[np.float64]:
    return np.linalg.norm(np.diff(guides.points.astype(np.float64), axis=1), axis=-1)


def may_change(guides: Guides) -> NDArray[np.bool_]:
    """Written out anew: not frozen, selected if any is, and free at the tip."""
    free = ~guides.frozen & (guides.hold[:, -1] < 1.0)
    return free & guides.selected if guides.selected.any() else free


def stays(before: Guides, after: Guides) -> None:
    """What every kernel that only shapes strands must keep."""
    assert np.isfinite(after.points).all()
    assert np.array_equal(before.ids, after.ids)
    assert after.roots is before.roots
    assert np.array_equal(before.points[:, 0], after.points[:, 0])
    untouched = before.frozen | (~before.selected & before.selected.any())
    assert np.array_equal(before.points[untouched], after.points[untouched])
    for row in range(len(before)):  # up to the last locked point nothing moves
        locked = np.flatnonzero(before.hold[row] >= 1.0)
        if len(locked):
            assert np.array_equal(before.points[row, : locked[-1] + 1], after.points[row, : locked[-1] + 1])


def radial_depth(context: SkinContext, points: NDArray) -> NDArray[np.float64]:
    """How far below the star-shaped triangles points lie, measured from the centre (at least the true depth).

    By brute force: the ray from the centre through each point against every triangle.
    """
    p = np.asarray(points, np.float64).reshape(-1, 3)
    corners = context.skin.mesh.points.astype(np.float64)[context.skin.triangles.vertices]
    inverse = np.linalg.inv(np.swapaxes(corners, 1, 2))  # direction = corners . weights
    size = np.linalg.norm(p, axis=1)
    out = np.empty(len(p))
    for start in range(0, len(p), 500):
        d = p[start : start + 500] / size[start : start + 500, None]
        weights = np.einsum("fab,nb->nfa", inverse, d)
        hit = weights.min(axis=2)
        face = np.argmax(hit, axis=1)
        out[start : start + 500] = 1.0 / weights[np.arange(len(d)), face].sum(axis=1)
    return out - size
