import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from core.mesh.bvh import build_bvh, cast_rays
from core.mesh.signed_distance import build_signed_skin, signed_distances, weld


def _arrays(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    return mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32)


def _winding_number(points: np.ndarray, triangles: np.ndarray, queries: np.ndarray) -> np.ndarray:
    """Solid angles (Van Oosterom and Strackee, 1983) over 4 pi: 1 inside a closed skin, 0 outside."""
    total = np.zeros(len(queries))
    for start in range(0, len(queries), 100):
        a, b, c = (points[triangles[:, k]].astype(np.float64) - queries[start : start + 100, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=2) for x in (a, b, c))
        volume = (a * np.cross(b, c)).sum(2)
        under = la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb
        total[start : start + 100] = np.arctan2(volume, under).sum(1) / (2 * np.pi)
    return total


def test_a_box_in_closed_form() -> None:
    half = np.array([1, 2, 0.5])
    points, triangles = _arrays(trimesh.creation.box(2 * half))
    skin = build_signed_skin(points, triangles)
    assert skin.closed
    queries = np.random.default_rng(0).uniform(-3, 3, (20_000, 3)).astype(np.float32)
    over = np.abs(queries) - half
    wanted = np.linalg.norm(np.maximum(over, 0), axis=1) + np.minimum(over.max(1), 0)
    np.testing.assert_allclose(signed_distances(skin, queries), wanted, atol=1e-5)


def test_a_spike_whose_faces_disagree_about_the_side() -> None:
    """Near a sharp tip the nearest face alone says inside for places outside; the pseudo-normal does not."""
    points, triangles = _arrays(trimesh.creation.cone(0.1, 2.0, sections=5))
    random = np.random.default_rng(1)
    queries = (random.normal(size=(5000, 3)) * 0.3 + [0, 0, 2]).astype(np.float32)
    inside = _winding_number(points, triangles, queries) > 0.5
    distance = signed_distances(build_signed_skin(points, triangles), queries)
    sure = np.abs(distance) > 1e-4
    np.testing.assert_array_equal((distance < 0)[sure], inside[sure])
    assert (~inside).sum() > 1000


def test_faces_that_share_no_vertices_count_as_joined() -> None:
    box = trimesh.creation.box()
    points = box.vertices[box.faces].reshape(-1, 3).astype(np.float32)
    triangles = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    skin = build_signed_skin(points, triangles)
    assert skin.closed
    corner = np.array([[0.6, 0.6, 0.6], [0.4, 0.4, 0.4], [0.51, 0.6, 0.0]], np.float32)
    np.testing.assert_allclose(
        signed_distances(skin, corner), [np.sqrt(0.03), -0.1, np.hypot(0.01, 0.1)], atol=1e-6
    )


def test_welding_numbers_places() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [-0.0, 0, 0], [1, 0, 1e-7]], np.float32)
    numbers = weld(points)
    assert numbers[0] == numbers[2]
    assert len(set(numbers.tolist())) == 3
    assert weld(np.zeros((0, 3), np.float32)).shape == (0,)


def test_an_open_skin_has_sides_over_its_faces_and_is_outside_beyond_its_border() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    skin = build_signed_skin(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    assert not skin.closed
    queries = np.array([[0.5, 0.4, 0.3], [0.5, 0.4, -0.3], [0.5, 0.5, -0.2], [1.3, 0.5, -0.4]], np.float32)
    np.testing.assert_allclose(signed_distances(skin, queries), [0.3, -0.3, -0.2, 0.5], atol=1e-6)


def test_flipped_faces_are_not_closed() -> None:
    points, triangles = _arrays(trimesh.creation.box())
    triangles = triangles.copy()
    triangles[0] = triangles[0, ::-1]
    assert not build_signed_skin(points, triangles).closed


def test_beyond_the_bound_and_not_finite_is_infinite() -> None:
    skin = build_signed_skin(*_arrays(trimesh.creation.box()))
    queries = np.array([[0, 0, 0], [0, 0, 0.45], [np.nan, 0, 0]], np.float32)
    distance = signed_distances(skin, queries, 0.1)
    assert np.isposinf(distance[[0, 2]]).all()
    assert distance[1] == pytest.approx(-0.05, abs=1e-6)
    empty = build_signed_skin(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    assert np.isposinf(signed_distances(empty, queries)).all()


def test_the_cat_against_winding_numbers_and_parity_of_rays() -> None:
    if "FILOPLUME_DATA" not in os.environ:
        pytest.skip("FILOPLUME_DATA is not set")
    path = Path(os.environ["FILOPLUME_DATA"]) / "meshes/odedstein_A/cat/cat-low-resolution.obj"
    points, triangles = _arrays(trimesh.load(path, process=False))
    skin = build_signed_skin(points, triangles)
    assert skin.closed
    random = np.random.default_rng(2)
    queries = random.uniform(points.min(0), points.max(0), (400, 3)).astype(np.float32)
    distance = signed_distances(skin, queries)
    np.testing.assert_array_equal(distance < 0, _winding_number(points, triangles, queries) > 0.5)
    bvh = build_bvh(points, triangles)
    here, crossings = queries.copy(), np.zeros(len(queries), int)
    direction = np.tile(np.float32([[0.3, 1, 0.2]]), (len(queries), 1))
    for _ in range(40):
        t, hit, _ = cast_rays(bvh, here, direction)
        crossings += hit >= 0
        here = np.where((hit >= 0)[:, None], here + direction * (np.where(hit >= 0, t, 0) + 1e-5)[:, None], here + 99)
        here = here.astype(np.float32)
    assert ((crossings % 2 == 1) == (distance < 0)).mean() > 0.99  # a step of 1e-5 may jump a fold
