"""Triangles cover exactly their faces: area, winding and outline agree with the shoelace formula."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.mesh.mesh import Mesh
from core.mesh.triangulate import triangulate


def polygons(*rings):
    """A mesh with one face per ring of 3-D points."""
    points = np.concatenate([np.asarray(ring, np.float32) for ring in rings])
    counts = np.array([len(ring) for ring in rings], np.int32)
    return Mesh(
        points=points, counts=counts, corners=np.arange(len(points), dtype=np.int32),
        parts=np.zeros(len(rings), np.int32), part_names=("all",),
    )  # fmt: skip


def flat(outline):
    return np.column_stack([np.asarray(outline, float), np.zeros(len(outline))])


def signed_areas(mesh, triangles):
    """z of the area vector of each triangle, for faces that lie in the plane z = 0."""
    p = mesh.points[triangles.vertices].astype(float)
    return np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2] / 2


def shoelace(outline):
    x, y = np.asarray(outline, np.float32).astype(float).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def star(angles, radii):
    return np.column_stack([np.cos(angles) * radii, np.sin(angles) * radii])


ARROW = [(0, 0), (2, 1), (0, 2), (0.5, 1)]
COMB = [(0, 0), (9, 0), *[(9 - i, 3 if i % 2 else 0.5) for i in range(10)]]
SPIRAL = np.concatenate(
    [star(np.linspace(0, 12, 90), np.linspace(1, 5, 90)), star(np.linspace(12, 0, 90), np.linspace(4.8, 0.8, 90))]
)


@pytest.mark.parametrize("outline", [ARROW, COMB, SPIRAL], ids=["arrow", "comb", "spiral"])
@pytest.mark.parametrize("turn", range(4))
def test_concave_faces_are_covered_exactly_from_any_first_corner(outline, turn):
    outline = np.roll(np.asarray(outline, float), turn, axis=0)
    mesh = polygons(flat(outline))
    triangles = triangulate(mesh)
    areas = signed_areas(mesh, triangles)
    assert len(areas) == len(outline) - 2
    assert areas.min() >= 0.0  # none outside, none turned over
    assert areas.sum() == pytest.approx(shoelace(outline), rel=1e-6)


@given(st.integers(5, 80), st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=150, deadline=None)
def test_star_shaped_faces_in_any_plane(count, seed, clockwise):
    rng = np.random.default_rng(seed)
    step = 2 * np.pi / count  # no two neighbours half a turn apart: the outline goes round its middle
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False) + rng.uniform(0, 0.9 * step, count)
    outline = star(angles, rng.uniform(0.2, 1.0, count))
    if clockwise:
        outline = outline[::-1]
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    mesh = polygons(flat(outline) @ turn)
    triangles = triangulate(mesh)
    p = mesh.points[triangles.vertices].astype(float)
    areas = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) / 2
    normal = np.linalg.det(turn) * turn[2] * np.sign(shoelace(outline))
    assert (areas @ normal).min() >= -1e-6
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(abs(shoelace(outline)), rel=1e-4)
    np.testing.assert_array_equal(mesh.corners[triangles.corners], triangles.vertices)


def test_flat_convex_quads_take_the_shorter_diagonal_and_equal_ones_the_first():
    kite = [(0, 0), (1, -0.2), (4, 0), (1, 0.2)]
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    triangles = triangulate(polygons(flat(kite), flat(square)))
    assert sorted(map(sorted, triangles.corners.tolist())) == [[0, 1, 3], [1, 2, 3], [4, 5, 6], [4, 6, 7]]
    np.testing.assert_array_equal(triangles.faces, [0, 0, 1, 1])


def test_triangles_pass_through_in_the_order_of_the_faces():
    rng = np.random.default_rng(3)
    rings = [rng.normal(size=(n, 3)) for n in (3, 5, 4, 3, 6, 4)]
    mesh = polygons(*rings)
    triangles = triangulate(mesh)
    np.testing.assert_array_equal(triangles.faces, np.repeat(np.arange(6), mesh.counts - 2))
    starts = mesh.starts
    for face in range(6):
        inside = triangles.corners[triangles.faces == face]
        assert set(inside.ravel()) == set(range(starts[face], starts[face] + mesh.counts[face]))


def test_edges_of_the_outline_are_used_once_and_cuts_twice():
    mesh = polygons(flat(SPIRAL))
    corners = triangulate(mesh).corners
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    ring = {(i, (i + 1) % len(SPIRAL)) for i in range(len(SPIRAL))}
    directed = set(map(tuple, edges.tolist()))
    assert len(directed) == len(edges)
    assert ring <= directed
    assert all((b, a) in directed for a, b in directed - ring)


@pytest.mark.parametrize("ring", [
    [(0, 0, 0)] * 6,
    [(i, 0, 0) for i in range(7)],
    [(0, 0, 0), (1, 0, 0), (0, 0, 0), (1, 0, 0)],
    [(np.cos(a), np.sin(a), 0) for a in np.arange(5) * 4 * np.pi / 5],
], ids=["a point", "a line", "a quad without area", "a pentagram"])  # fmt: skip
def test_faces_without_sense_still_get_their_triangles(ring):
    triangles = triangulate(polygons(np.array(ring, float)))
    assert len(triangles.vertices) == len(ring) - 2
    assert set(triangles.corners.ravel()) == set(range(len(ring)))


def test_a_monstrous_face_ends():
    angles = np.linspace(0, 2 * np.pi, 60_000, endpoint=False)
    outline = star(angles, np.where(np.arange(60_000) % 2, 1.0, 0.2))
    start = time.monotonic()
    assert len(triangulate(polygons(flat(outline))).vertices) == 59_998
    assert time.monotonic() - start < 60


def test_no_faces():
    empty = Mesh(points=np.zeros((3, 3), np.float32), counts=np.zeros(0, np.int32), corners=np.zeros(0, np.int32),
                 parts=np.zeros(0, np.int32), part_names=())  # fmt: skip
    assert triangulate(empty).vertices.shape == (0, 3)
