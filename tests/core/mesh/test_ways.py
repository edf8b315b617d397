"""Ways over a skin against great circles, straight lines and folds."""

import numpy as np
import trimesh

from core.mesh.ways import distances_over, skin_ways


def grid(n, height=lambda x, z: np.zeros_like(x)):
    x, z = np.meshgrid(np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 1.0, n + 1), indexing="ij")
    points = np.stack([x.ravel(), height(x, z).ravel(), z.ravel()], axis=1).astype(np.float32)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a = np.stack([first, first + 1, first + n + 2], axis=1)
    b = np.stack([first, first + n + 2, first + n + 1], axis=1)
    return points, np.concatenate([a, b]).astype(np.int32)


def from_vertex(points, triangles, vertex, limit=np.inf):
    return distances_over(skin_ways(points, triangles), np.array([vertex]), np.zeros(1), limit)


def test_on_a_sphere_ways_are_great_circles_within_five_percent():
    ball = trimesh.creation.icosphere(4, 1.0)
    points = np.asarray(ball.vertices, np.float32)
    found = from_vertex(points, np.asarray(ball.faces, np.int32), 7)
    true = np.arccos(np.clip(points.astype(np.float64) @ points[7], -1.0, 1.0))
    far = true > 0.3
    ratio = found[far] / true[far]
    assert ratio.min() > 0.99  # the triangles lie a little inside the sphere
    assert ratio.max() < 1.05


def test_on_a_plane_no_way_is_shorter_than_the_line_and_none_much_longer():
    points, triangles = grid(24)
    found = from_vertex(points, triangles, 12 * 25 + 12)
    true = np.linalg.norm(points - points[12 * 25 + 12], axis=1)
    assert (found >= true - 1e-6).all()
    assert (found <= 1.1 * true + 1e-6).all()


def test_a_way_goes_around_a_fold_and_over_welded_cracks():
    points, triangles = grid(40)
    angle = np.clip((points[:, 0] - 0.45) / 0.1, 0.0, 1.0) * np.pi  # folded back on itself, a thin sheet of two sides
    r = 0.1 / np.pi
    back = np.maximum(points[:, 0] - 0.55, 0.0)
    folded = points.copy()
    folded[:, 0] = np.minimum(points[:, 0], 0.45) + r * np.sin(angle) - back
    folded[:, 1] = r * (1.0 - np.cos(angle))
    a, b = 4 * 41 + 20, 36 * 41 + 20  # 0.1 and 0.9 along the sheet, 2 r apart in space
    assert np.linalg.norm(folded[a] - folded[b]) < 0.08
    assert 0.78 < from_vertex(folded, triangles, a)[b] < 0.82
    cracked = folded[triangles].reshape(-1, 3)
    apart = np.arange(len(cracked), dtype=np.int32).reshape(-1, 3)
    there, here = (np.flatnonzero((cracked == folded[v]).all(axis=1))[0] for v in (b, a))
    assert 0.78 < from_vertex(cracked, apart, here)[there] < 0.82


def test_what_is_too_far_or_apart_is_infinitely_far():
    points, triangles = grid(10)
    both = np.concatenate([points, points + np.float32(3.0)]).astype(np.float32)
    found = from_vertex(both, np.concatenate([triangles, triangles + len(points)]), 0, limit=0.5)
    assert np.isinf(found[len(points):]).all()
    assert np.isinf(found[: len(points)][np.linalg.norm(points, axis=1) > 0.5]).all()
    assert np.isfinite(found[: len(points)][np.linalg.norm(points, axis=1) < 0.4]).all()
    assert np.isinf(distances_over(skin_ways(points, triangles), np.array([0]), np.array([2.0]), 1.0)).all()
