"""Sculpting: milliseconds of one dab of every brush, and of finding what is found once per mesh."""

from __future__ import annotations

import numpy as np

from core.mesh.mesh import Mesh
from core.pose.sculpt.brushes import draw, flatten, grab, inflate, pinch, relax, restore, smooth
from core.pose.sculpt.mask import blur_mask, no_mask, paint_mask
from core.pose.sculpt.ring import ring_at
from core.pose.sculpt.surface import sculpt_surface
from core.pose.sculpt.symmetry import opposites_by_topology
from tests.bench.bench import Row, median_ms

TITLE = "Sculpting"
SIDE = 317  # 100,489 vertices
DAB = 8.0  # milliseconds
RADIUS = 0.0799  # covers 2 % of a square of side 1


def run() -> list[Row]:
    mesh = _hills()
    surface = sculpt_surface(mesh)
    rng = np.random.default_rng(0)
    points = (mesh.points + rng.normal(0.0, 2e-4, mesh.points.shape)).astype(np.float32)
    centre = points[len(points) // 2]
    mask = no_mask(surface)
    brushes = {
        "Grab": lambda ring: grab(surface, points, ring, (0.01, 0.0, 0.01)),
        "Draw": lambda ring: draw(surface, points, ring, 0.01),
        "Inflate": lambda ring: inflate(surface, points, ring, 0.01),
        "Pinch": lambda ring: pinch(surface, points, ring, 0.3),
        "Flatten": lambda ring: flatten(surface, points, ring, 0.5),
        "Restore": lambda ring: restore(surface, points, ring, mesh.points, 0.5),
        "Smooth, 2 rounds": lambda ring: smooth(surface, points, ring, 1.0),
        "Relax, 4 rounds": lambda ring: relax(surface, points, ring, 1.0),
        "Mask": lambda ring: paint_mask(surface, mask, ring),
        "Mask blur": lambda ring: blur_mask(surface, mask, ring),
    }
    share = len(ring_at(surface, points, centre, RADIUS).sites) / len(points)
    rows = [
        Row(f"{name}: dab on {len(points):,} vertices, ring over {share:.1%}",
            median_ms(lambda: call(ring_at(surface, points, centre, RADIUS, mask=mask)), runs=31, warm=3), "ms", DAB)  # noqa: B023
        for name, call in brushes.items()
    ]
    rows.append(Row("neighbours and corners of that mesh, once", median_ms(lambda: sculpt_surface(mesh), runs=3), "ms"))
    rows.append(Row("its opposites by topology, once", median_ms(lambda: opposites_by_topology(mesh), runs=3), "ms"))
    return rows


def _hills() -> Mesh:
    u = np.linspace(-0.5, 0.5, SIDE)
    x, y = (a.ravel() for a in np.meshgrid(u, u))
    z = 0.03 * np.cos(7.0 * x) * np.sin(5.0 * y)
    a = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    corners = np.stack([a, a + 1, a + SIDE + 1, a + SIDE], axis=1).astype(np.int32)
    return Mesh(
        points=np.stack([x, y, z], axis=1).astype(np.float32), counts=np.full(len(corners), 4, np.int32),
        corners=corners.reshape(-1), parts=np.zeros(len(corners), np.int32), part_names=("hills",),
    )
