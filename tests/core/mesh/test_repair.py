"""Trouble is counted exactly where it was put, and what comes out is sound."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from core.errors import UserError
from core.mesh.edges import is_closed, next_corner, reversed_corners
from core.mesh.polygons import Polygons
from core.mesh.repair import LARGEST, PROBLEMS, repair


def polygons(points, faces, uvs=None, parts=None):
    return Polygons(
        np.asarray(points, float),
        np.array([len(face) for face in faces], np.int64),
        np.array([corner for face in faces for corner in face], np.int64),
        None if uvs is None else np.asarray(uvs, np.float32),
        np.zeros(len(faces), np.int32) if parts is None else np.asarray(parts, np.int32),
        ("mesh",) if parts is None else tuple(f"part{i}" for i in range(max(parts) + 1)),
    )


def faces_of(mesh):
    return [ring.tolist() for ring in np.split(mesh.corners, np.cumsum(mesh.counts)[:-1])]


def turned(ring):
    """The same face beginning with its lowest vertex."""
    at = ring.index(min(ring))
    return tuple(ring[at:] + ring[:at])


CUBE_POINTS = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
CUBE = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def volume(mesh):
    p = mesh.points.astype(float)
    return sum(
        np.dot(p[ring[0]], np.cross(p[ring[i]], p[ring[i + 1]])) / 6
        for ring in faces_of(mesh)
        for i in range(1, len(ring) - 1)
    )


def test_a_sound_cube_passes_unchanged():
    uvs = np.random.default_rng(0).random((24, 2), np.float32)
    found = repair(polygons(CUBE_POINTS, CUBE, uvs))
    assert found.problems == {}
    assert found.closed
    assert volume(found.mesh) == pytest.approx(1.0)
    assert faces_of(found.mesh) == CUBE
    np.testing.assert_array_equal(found.mesh.uvs, uvs)
    np.testing.assert_array_equal(found.vertex_of_source, np.arange(8))
    np.testing.assert_array_equal(found.face_of_source, np.arange(6))


def test_an_inside_out_cube_is_turned_with_its_uvs():
    uvs = np.arange(48, dtype=np.float32).reshape(24, 2)
    found = repair(polygons(CUBE_POINTS, [face[::-1] for face in CUBE], uvs))
    assert found.problems == {"flipped_faces": 6}
    assert volume(found.mesh) == pytest.approx(1.0)
    old = [dict(zip(face[::-1], uvs[4 * i : 4 * i + 4].tolist(), strict=True)) for i, face in enumerate(CUBE)]
    new = found.mesh.uvs.reshape(6, 4, 2).tolist()
    for face, ring, rows in zip(old, faces_of(found.mesh), new, strict=True):
        assert [face[vertex] for vertex in ring] == rows


@given(st.lists(st.booleans(), min_size=6, max_size=6))
@settings(deadline=None)
def test_any_faces_of_a_cube_turned_over_are_turned_back(flips):
    faces = [face[::-1] if flip else face for face, flip in zip(CUBE, flips, strict=True)]
    found = repair(polygons(CUBE_POINTS, faces))
    assert volume(found.mesh) == pytest.approx(1.0)
    assert found.problems.get("flipped_faces", 0) == sum(flips)
    assert [turned(ring) for ring in faces_of(found.mesh)] == [turned(ring) for ring in CUBE]


def test_an_open_piece_follows_the_greater_part_of_its_faces():
    points = [(x, y, 0) for y in range(2) for x in range(6)]
    strip = [[x, x + 1, x + 7, x + 6] for x in range(5)]
    faces = [strip[0], strip[1][::-1], strip[2], strip[3], strip[4][::-1]]
    found = repair(polygons(points, faces))
    assert found.problems["flipped_faces"] == 2
    assert [turned(ring) for ring in faces_of(found.mesh)] == [tuple(ring) for ring in strip]


def test_a_moebius_strip_is_left_as_it_is_and_is_not_closed():
    n = 12
    angles = np.arange(n) * 2 * np.pi / n
    side = np.stack([np.cos(angles / 2) * np.cos(angles), np.cos(angles / 2) * np.sin(angles), np.sin(angles / 2)], 1)
    middle = 3 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)
    points = np.concatenate([middle + side, middle - side])
    faces = [[i, i + 1, n + i + 1, n + i] for i in range(n - 1)] + [[n - 1, n, 0, 2 * n - 1]]
    found = repair(polygons(points, faces))
    assert len(found.mesh.counts) == n
    assert not found.closed


def test_the_inner_wall_of_a_hollow_ball_keeps_looking_inwards_and_a_ball_beside_it_is_turned():
    ball = trimesh.creation.icosphere(1)
    inner = (ball.vertices * 0.5, ball.faces[:, ::-1])
    beside = (ball.vertices + 5, ball.faces[:, ::-1])
    v = len(ball.vertices)
    faces = np.concatenate([ball.faces, inner[1] + v, beside[1] + 2 * v])
    found = repair(polygons(np.concatenate([ball.vertices, inner[0], beside[0]]), faces.tolist()))
    assert found.problems["flipped_faces"] == len(ball.faces)
    assert found.problems["islands"] == 3
    assert volume(found.mesh) == pytest.approx(ball.volume * (1 - 0.125 + 1), rel=1e-4)


def test_a_soup_becomes_the_surface_it_came_from():
    ball = trimesh.creation.icosphere(3)
    soup = ball.vertices[ball.faces].reshape(-1, 3)
    found = repair(polygons(soup, np.arange(len(soup)).reshape(-1, 3).tolist()))
    assert found.closed
    assert len(found.mesh.points) == len(ball.vertices)
    assert found.problems["duplicate_vertices"] == len(soup) - len(ball.vertices)
    np.testing.assert_allclose(found.mesh.points[found.vertex_of_source], soup, atol=1e-6)


def test_seams_of_uvs_survive_the_joining():
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0)]
    uvs = np.arange(16, dtype=np.float32).reshape(8, 2)
    found = repair(polygons(points, [[0, 1, 2, 3], [4, 5, 6, 7]], uvs))
    assert found.problems == {"duplicate_vertices": 2}
    assert faces_of(found.mesh) == [[0, 1, 2, 3], [1, 4, 5, 2]]
    np.testing.assert_array_equal(found.mesh.uvs, uvs)


def test_pieces_that_touch_or_belong_to_two_parts_are_not_joined():
    pair = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0)]
    apart = repair(polygons(pair, [[0, 1, 2, 3], [4, 5, 6, 7]], parts=[0, 1]))
    assert "duplicate_vertices" not in apart.problems
    cubes = np.concatenate([CUBE_POINTS, np.add(CUBE_POINTS, 1.0)])  # share one corner
    touching = repair(polygons(cubes, CUBE + [[v + 8 for v in face] for face in CUBE]))
    assert touching.problems["islands"] == 2
    assert len(touching.mesh.points) == 16


def test_bad_faces_are_left_out_and_counted_once_each():
    points = [*CUBE_POINTS, (np.nan, 0, 0), (9, 9, np.inf), (LARGEST * 10, 0, 0), (5, 5, 5)]
    faces = [
        *CUBE,
        [0, 1, 99], [0, -1, 2], [-2, 3, 1, 0],  # out of range
        [0, 1, 8], [9, 1, 2, 3],  # not finite
        [0, 1], [4], [], [0, 1, 0], [2, 2, 2, 2], [0, 1, 1],  # degenerate
        [3, 2, 0, 1], [2, 3, 1, 0],  # the first face again, turned and mirrored
    ]  # fmt: skip
    found = repair(polygons(points, faces))
    assert {k: v for k, v in found.problems.items() if k != "missing_uvs"} == {
        "nonfinite_vertices": 3, "out_of_range_faces": 3, "nonfinite_faces": 2, "degenerate_faces": 6,
        "duplicate_faces": 2, "loose_vertices": 4,
    }  # fmt: skip
    assert found.closed
    assert faces_of(found.mesh) == CUBE
    assert np.abs(found.mesh.points).max() <= 5
    np.testing.assert_array_equal(found.face_of_source, [0, 1, 2, 3, 4, 5] + [-1] * 13)


def test_a_repeated_neighbour_is_left_out_of_its_face():
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    found = repair(polygons(square, [[0, 1, 1, 2, 3, 0]], np.arange(12).reshape(6, 2)))
    assert faces_of(found.mesh) == [[0, 1, 2, 3]]
    np.testing.assert_array_equal(found.mesh.uvs[:, 0], [0, 4, 6, 8])


def test_a_face_that_goes_round_itself_does_so_once():
    found = repair(polygons(CUBE_POINTS, [*CUBE[:4], CUBE[4] * 3, CUBE[5] * 40], np.arange(376).reshape(188, 2)))
    assert found.closed
    assert faces_of(found.mesh) == CUBE
    np.testing.assert_array_equal(found.mesh.uvs[16:24], np.r_[32:40, 56:64].reshape(8, 2))


def test_three_faces_on_an_edge_are_counted():
    points = [(0, 0, 0), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0)]
    found = repair(polygons(points, [[0, 1, 2], [1, 0, 3], [0, 1, 4]]))
    assert found.problems["nonmanifold_edges"] == 1
    assert not found.closed


def test_faces_without_area_are_counted_but_stay():
    found = repair(polygons([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], [[0, 1, 2], [0, 2, 3]]))
    assert found.problems["zero_area_faces"] == 1
    assert len(found.mesh.counts) == 2


def test_faces_without_uvs_get_zero_and_are_counted():
    uvs = [(0.1, 0.2)] * 4 + [(np.nan, np.nan)] * 4 + [(0.3, 0.4)] * 15 + [(np.inf, 0)]
    found = repair(polygons(CUBE_POINTS, CUBE, uvs))
    assert found.problems == {"missing_uvs": 2}
    np.testing.assert_array_equal(found.mesh.uvs[4:8], 0)
    np.testing.assert_array_equal(found.mesh.uvs[20:24], 0)
    np.testing.assert_array_equal(found.mesh.uvs[:4], np.float32([(0.1, 0.2)] * 4))


@pytest.mark.parametrize(("points", "faces"), [
    ([(np.nan, 0, 0)] * 3, [[0, 1, 2]]),
    (CUBE_POINTS, [[0, 1, 50]]),
    (CUBE_POINTS, [[0, 0, 0], [1, 2]]),
], ids=["nothing finite", "nothing in range", "nothing with area"])  # fmt: skip
def test_hopeless_polygons_are_refused(points, faces):
    with pytest.raises(UserError, match="export it again"):
        repair(polygons(points, faces))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=200, deadline=None)
def test_whatever_comes_in_what_goes_out_is_sound(seed):
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 3, (rng.integers(1, 30), 3)).astype(float)
    points[rng.random(len(points)) < 0.05] = rng.choice([np.nan, np.inf, -1e300])
    faces = [rng.integers(-2, len(points) + 2, rng.integers(0, 7)).tolist() for _ in range(rng.integers(1, 30))]
    uvs = rng.random((sum(map(len, faces)), 2)) if rng.random() < 0.5 else None
    try:
        found = repair(polygons(points, faces, uvs, rng.integers(0, 3, len(faces))))
    except UserError:
        return
    mesh = found.mesh
    assert set(found.problems) <= set(PROBLEMS)
    assert all(len(set(ring)) >= 3 for ring in faces_of(mesh))
    assert (mesh.corners[next_corner(mesh.counts)] != mesh.corners).all()
    assert len({tuple(sorted(ring)) for ring in faces_of(mesh)}) == len(mesh.counts)
    assert found.closed == is_closed(mesh)
    assert (found.face_of_source >= 0).sum() == len(mesh.counts)
    again = repair(Polygons(mesh.points.astype(float), mesh.counts.astype(np.int64), mesh.corners.astype(np.int64),
                            mesh.uvs, mesh.parts, mesh.part_names))  # fmt: skip
    assert not {"out_of_range_faces", "nonfinite_faces", "degenerate_faces", "duplicate_faces"} & set(again.problems)


def test_a_face_that_repeats_another_once_its_doubled_corners_are_gone_is_left_out():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    found = repair(polygons(points, [[0, 1, 2], [0, 1, 1, 2], [2, 2, 0, 1, 1]], None, np.array([0, 1, 2])))
    assert faces_of(found.mesh) == [[0, 1, 2]]
    assert found.problems["duplicate_faces"] == 2


def test_closed_agrees_with_trimesh():
    ball = trimesh.creation.icosphere(2)
    for faces in (ball.faces, ball.faces[1:], np.concatenate([ball.faces, ball.faces[:1, ::-1]])):
        found = repair(polygons(ball.vertices, faces.tolist()))
        theirs = trimesh.Trimesh(found.mesh.points, found.mesh.corners.reshape(-1, 3), process=False)
        assert found.closed == theirs.is_watertight


def test_reversed_corners_turn_each_face_over():
    counts = np.array([3, 5, 4])
    np.testing.assert_array_equal(reversed_corners(counts), [2, 1, 0, 7, 6, 5, 4, 3, 11, 10, 9, 8])
    np.testing.assert_array_equal(next_corner(counts), [1, 2, 0, 4, 5, 6, 7, 3, 9, 10, 11, 8])
