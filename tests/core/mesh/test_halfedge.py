"""Half-edges of clean and of broken soups: always a closed oriented manifold."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from core.mesh.halfedge import Manifold, manifold, weld
from tests.core.mesh.skin_samples import ball, joined, sheet


def assert_closed(m: Manifold) -> None:
    h = np.arange(len(m.origin))
    after = h - h % 3 + (h + 1) % 3
    before = h - h % 3 + (h + 2) % 3
    assert (m.twin >= 0).all()
    assert (m.twin[m.twin] == h).all()
    assert (m.twin != h).all()
    assert (m.origin[m.twin] == m.origin[after]).all()
    assert (m.length == m.length[m.twin]).all()
    assert (m.length < m.length[after] + m.length[before]).all()
    # one fan around every vertex: walking around it meets all its corners
    corners = np.bincount(m.origin, minlength=m.vertices)
    met = np.zeros(m.vertices, int)
    start = np.zeros(m.vertices, int)
    start[m.origin] = h
    at = start.copy()
    going = np.ones(m.vertices, bool)
    for _ in range(int(corners.max(initial=0))):
        met[going] += 1
        at = m.twin[before[at]]
        going &= at != start
    assert (met == corners).all()


def test_euler_number_of_a_ball_and_a_torus() -> None:
    for skin, euler in ((ball(2), 2), (None, 0)):
        if skin is None:
            mesh = trimesh.creation.torus(1.0, 0.3)
            skin = np.array(mesh.vertices), np.array(mesh.faces, np.int32)
        m = manifold(*skin)
        assert_closed(m)
        assert m.vertices - len(m.origin) // 2 + len(m.origin) // 3 == euler
        assert len(m.loops) == 0
        assert m.components == 1


def test_an_open_sheet_gets_one_phantom_with_its_border_as_length() -> None:
    m = manifold(*sheet(6, 0.3, np.random.default_rng(0)))
    assert_closed(m)
    assert m.loops == pytest.approx([4.0])
    assert not m.filled.any()
    assert manifold(*sheet(6, 0.3, np.random.default_rng(0)), fill=5.0).filled.all()


def test_flipped_faces_and_cracks_are_mended() -> None:
    points, triangles = ball(2)
    rng = np.random.default_rng(1)
    turned = rng.random(len(triangles)) < 0.4
    triangles[turned] = triangles[turned][:, [0, 2, 1]]
    soup = points[triangles].reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    m = manifold(*soup)
    assert_closed(m)
    assert m.vertices == len(points)
    assert len(m.loops) == 0
    # corners of the soup are found again, whichever way their face was turned
    v = m.corner_vertex
    length = np.linalg.norm(soup[0][soup[1][:, 0]] - soup[0][soup[1][:, 1]], axis=1)
    pairs = {(int(a), int(b)): s for a, b, s in zip(m.origin, m.origin[m.twin], m.length, strict=True)}
    for a, b, s in zip(v[:, 0], v[:, 1], length, strict=True):
        assert pairs[int(a), int(b)] == pytest.approx(s, rel=1e-3)


def test_weld_takes_zero_and_minus_zero_for_one_place() -> None:
    p = np.array([[0.0, 1, 2], [3, 4, 5], [-0.0, 1, 2]])
    assert weld(p).tolist() == [0, 1, 0]


def test_pieces_are_counted() -> None:
    a = ball(1)
    b = a[0] + 3.0, a[1]
    m = manifold(*joined(a, b))
    assert m.components == 2
    assert len(np.unique(m.component[m.corner_vertex[:80]])) == 1


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 14), st.integers(1, 40))
def test_any_soup_becomes_a_closed_manifold(seed: int, vertices: int, faces: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.random((vertices, 3))
    points[rng.integers(vertices)] = points[rng.integers(vertices)]
    if seed % 5 == 0:
        points[0] = np.nan
    triangles = rng.integers(0, vertices, (faces, 3)).astype(np.int32)
    m = manifold(points, triangles)
    assert_closed(m)
    assert ((m.face >= 0) == (m.corner_vertex >= 0).all(1)).all()
