"""Questions to the skin: closest points, rays, the distance field, the scatter."""

from __future__ import annotations

import numpy as np

from core.mesh.bvh import build_bvh, cast_rays, closest_points, refit
from core.mesh.distance_field import build_distance_field
from core.mesh.scatter import scatter
from core.workers import Workers
from tests.bench.bench import Row, median_ms

TITLE = "Geometry of the skin"


def creature(around: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed bumpy body of 2 around (along - 1) triangles (poles left open by a pinhole)."""
    u = np.linspace(0, 2 * np.pi, around, endpoint=False)
    v = np.linspace(0.02, np.pi - 0.02, along)
    across, down = np.meshgrid(u, v)
    radius = 1 + 0.15 * np.sin(5 * across) * np.sin(4 * down)
    points = np.stack(
        [radius * np.sin(down) * np.cos(across), radius * np.cos(down), radius * np.sin(down) * np.sin(across)], -1
    )
    i, j = np.arange(along - 1)[:, None] * around, np.arange(around)[None]
    a, b = i + j, i + (j + 1) % around
    quads = np.stack([a, b, b + around, a + around], -1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return points.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32)


def run() -> list[Row]:
    """Measure on 20,000 triangles (the scatter on 16,000) with one worker per core."""
    random = np.random.default_rng(0)
    points, triangles = creature(100, 101)
    bvh = build_bvh(points, triangles)
    edge = float(np.linalg.norm(points[triangles[:, 0]] - points[triangles[:, 1]], axis=1).mean())
    index, weights = random.integers(0, len(triangles), 100_000), random.dirichlet((1, 1, 1), 100_000)
    on_skin = (points[triangles[index]] * weights[:, :, None]).sum(1)
    near = (on_skin + random.normal(size=on_skin.shape) * edge).astype(np.float32)
    anywhere = random.uniform(-1.3, 1.3, (100_000, 3)).astype(np.float32)
    ways = random.normal(size=(100_000, 3)).astype(np.float32)
    body, faces = creature(100, 81)
    large, many = creature(400, 251)
    workers = Workers()
    try:
        return [
            Row("closest points, 100,000 on 20,000 triangles, bounded (3 edges), about the skin",
                median_ms(lambda: closest_points(bvh, near, 3 * edge, workers)), "ms", 45),
            Row("closest points, 100,000 on 20,000 triangles, bounded (3 edges), in the box",
                median_ms(lambda: closest_points(bvh, anywhere, 3 * edge, workers)), "ms", 45),
            Row("closest points, 100,000 on 20,000 triangles, unbounded, in the box",
                median_ms(lambda: closest_points(bvh, anywhere, workers=workers)), "ms", 250),
            Row("100,000 rays on 20,000 triangles",
                median_ms(lambda: cast_rays(bvh, anywhere, ways, workers=workers)), "ms"),
            Row("hierarchy over 20,000 triangles, built", median_ms(lambda: build_bvh(points, triangles)), "ms", 30),
            Row("hierarchy over 20,000 triangles, refitted", median_ms(lambda: refit(bvh, points)), "ms"),
            Row("hierarchy over 200,000 triangles, built", median_ms(lambda: build_bvh(large, many), 3), "ms", 400),
            Row("distance field of 16,000 triangles, 200 cells along",
                median_ms(lambda: build_distance_field(body, faces, workers=workers), 3), "ms", 1000),
            Row("even scatter of 200,000 on 16,000 triangles, one thread",
                median_ms(lambda: scatter(body, faces, 200_000), 5), "ms", 370),
            Row("even scatter of 20,000 on 16,000 triangles, one thread",
                median_ms(lambda: scatter(body, faces, 20_000), 5), "ms"),
        ]
    finally:
        workers.close()
