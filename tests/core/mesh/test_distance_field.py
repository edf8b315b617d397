import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numba import njit

from core.mesh.distance_field import build_distance_field, sample_field, sample_gradient, sample_points
from core.mesh.signed_distance import build_signed_skin, signed_distances
from core.workers import Workers

CENTRE = np.array([10.0, 3.0, -2.0])


def _ball() -> tuple[np.ndarray, np.ndarray]:
    ball = trimesh.creation.icosphere(5)
    return (ball.vertices + CENTRE).astype(np.float32), ball.faces.astype(np.int32)


@njit
def _gradients(values, origin, cell, queries, out):  # type: ignore[no-untyped-def]
    for i in range(len(queries)):
        x, y, z = queries[i, 0], queries[i, 1], queries[i, 2]
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = sample_gradient(values, origin, cell, x, y, z)
        out[i, 4] = sample_field(values, origin, cell, x, y, z)


def test_a_sphere_in_closed_form() -> None:
    field = build_distance_field(*_ball(), cell=0.02, band=0.1)
    random = np.random.default_rng(0)
    ways = random.normal(size=(20_000, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    radius = random.uniform(0.0, 1.6, 20_000)
    queries = CENTRE + ways * radius[:, None]
    found = sample_points(field, queries.astype(np.float32))
    within = np.abs(radius - 1) < 0.08
    np.testing.assert_allclose(found[within], (radius - 1)[within], atol=2e-3)  # flat faces cost 1e-3
    clamped = np.abs(radius - 1) > 0.14
    np.testing.assert_allclose(found[clamped], 0.1 * np.sign(radius - 1)[clamped], rtol=1e-6)

    out = np.empty((20_000, 5))
    _gradients(field.values, field.origin, field.cell, queries, out)
    np.testing.assert_allclose(out[:, 0], out[:, 4], atol=1e-7)
    inner = np.abs(radius - 1) < 0.06  # a cell's diagonal from the clamp
    cosine = (out[inner, 1:4] * ways[inner]).sum(1)
    assert cosine.min() > 0.98
    assert np.linalg.norm(out[inner, 1:4], axis=1).max() < 1.03
    assert np.abs(out[clamped, 1:4]).max() == 0


def test_gradient_is_the_difference_of_values() -> None:
    points, triangles = _ball()
    field = build_distance_field((points - CENTRE).astype(np.float32) * np.float32([1, 0.4, 0.7]), triangles, cell=0.05)
    cells = np.random.default_rng(1).integers(1, np.array(field.values.shape) - 2, (500, 3))
    queries = field.origin + field.cell * (cells + np.random.default_rng(2).uniform(0.1, 0.9, (500, 3)))
    out, ahead, behind = (np.empty((500, 5)) for _ in range(3))
    _gradients(field.values, field.origin, field.cell, queries, out)
    for axis in range(3):
        step = np.eye(3)[axis] * 1e-5
        _gradients(field.values, field.origin, field.cell, queries + step, ahead)
        _gradients(field.values, field.origin, field.cell, queries - step, behind)
        np.testing.assert_allclose(out[:, 1 + axis], (ahead[:, 0] - behind[:, 0]) / 2e-5, atol=1e-6)


def test_grid_values_are_the_exact_distances() -> None:
    """Every grid point, skipped blocks too, against the direct query; thin parts and a cavity among them."""
    outer = trimesh.creation.box((1, 1, 1))
    cavity = trimesh.creation.icosphere(2, radius=0.3)
    cavity.invert()
    fin = trimesh.creation.box((0.6, 0.02, 0.4))
    fin.apply_translation((0.9, 0.2, 0.0))
    mesh = trimesh.util.concatenate([outer, cavity, fin])
    points, triangles = mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32)
    workers = Workers(2)
    try:
        field = build_distance_field(points, triangles, cell=0.04, band=0.1, workers=workers)
    finally:
        workers.close()
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in field.values.shape), indexing="ij"), -1).reshape(-1, 3)
    places = (field.origin + field.cell * grid).astype(np.float32)
    wanted = np.clip(signed_distances(build_signed_skin(points, triangles), places), -field.band, field.band)
    np.testing.assert_allclose(field.values.ravel(), wanted, atol=2e-6)
    hollow = tuple((-field.origin / field.cell).astype(int))
    assert field.values[hollow] == pytest.approx(0.1)  # the cavity is outside


def test_outside_the_grid_and_not_finite_is_safe() -> None:
    field = build_distance_field(*_ball(), cell=0.1)
    far = np.array([[1e9, 0, 0], [-1e9, 5, 5], [np.inf, 0, 0], [np.nan, np.nan, 0]], np.float32)
    np.testing.assert_allclose(sample_points(field, far)[:3], field.band)


def test_memory_is_capped_and_empty_meshes_are_outside() -> None:
    points, triangles = _ball()
    field = build_distance_field(points[triangles[:1]][0], np.array([[0, 1, 2]], np.int32), cell=1e-5, band=1e-5)
    assert field.values.nbytes <= 96_000_000
    empty = build_distance_field(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    assert (sample_points(empty, points) > 0).all()


def test_an_open_sheet_has_two_sides_near_it() -> None:
    side = np.linspace(0, 1, 11)
    x, z = np.meshgrid(side, side)
    points = np.stack([x, 0 * x, z], -1).reshape(-1, 3).astype(np.float32)
    i = (np.arange(10)[:, None] * 11 + np.arange(10)).ravel()
    triangles = np.concatenate([np.stack([i, i + 11, i + 12], 1), np.stack([i, i + 12, i + 1], 1)]).astype(np.int32)
    field = build_distance_field(points, triangles, cell=0.01, band=0.05)
    inner = np.random.default_rng(3).uniform(0.1, 0.9, (1000, 3)).astype(np.float32)
    inner[:, 1] = np.random.default_rng(4).uniform(-0.04, 0.04, 1000)
    np.testing.assert_allclose(sample_points(field, inner), inner[:, 1], atol=1e-5)


def test_the_cat() -> None:
    if "FILOPLUME_DATA" not in os.environ:
        pytest.skip("FILOPLUME_DATA is not set")
    path = Path(os.environ["FILOPLUME_DATA"]) / "meshes/odedstein_A/cat/cat-low-resolution.obj"
    mesh = trimesh.load(path, process=False)
    points, triangles = mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32)
    skin = build_signed_skin(points, triangles)
    field = build_distance_field(points, triangles, skin=skin)
    assert 190 <= max(field.values.shape) <= 220
    queries = np.random.default_rng(5).uniform(points.min(0), points.max(0), (20_000, 3)).astype(np.float32)
    exact = signed_distances(skin, queries)
    found = sample_points(field, queries)
    near = np.abs(exact) < field.band - 2 * field.cell
    assert np.abs(found - exact)[near].max() < 0.5 * field.cell
    assert np.abs(found - exact)[near].mean() < 0.03 * field.cell
    sure = np.abs(exact) > 0.5 * field.cell
    np.testing.assert_array_equal((found < 0)[sure], (exact < 0)[sure])
