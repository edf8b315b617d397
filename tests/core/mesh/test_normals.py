import numpy as np
import trimesh

from core.mesh.mesh import Mesh
from core.mesh.normals import face_areas, face_normals, mesh_normals, vertex_normals


def _sphere() -> tuple[np.ndarray, np.ndarray]:
    ball = trimesh.creation.icosphere(3, radius=2.0)
    return ball.vertices.astype(np.float32), ball.faces.astype(np.int32)


def test_against_trimesh() -> None:
    points, triangles = _sphere()
    points = points * np.float32([1, 0.5, 2])
    other = trimesh.Trimesh(points, triangles, process=False)
    np.testing.assert_allclose(face_normals(points, triangles), other.face_normals, atol=2e-6)
    np.testing.assert_allclose(face_areas(points, triangles), other.area_faces, rtol=1e-5)
    wanted = trimesh.geometry.weighted_vertex_normals(len(points), triangles, other.face_normals, other.face_angles)
    np.testing.assert_allclose(vertex_normals(points, triangles), wanted, atol=2e-6)


def test_a_cube_of_quads_has_diagonal_normals_however_it_is_cut() -> None:
    box = trimesh.creation.box()
    points = box.vertices.astype(np.float32)
    corners = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32
    )
    mesh = Mesh(
        points=points, counts=np.full(6, 4, np.int32), corners=corners.ravel(), parts=np.zeros(6, np.int32),
        part_names=("box",),
    )
    outwards = points / np.linalg.norm(points, axis=1)[:, None]
    np.testing.assert_allclose(mesh_normals(mesh), outwards, atol=1e-6)
    np.testing.assert_allclose(vertex_normals(points, box.faces.astype(np.int32)), outwards, atol=1e-6)


def test_degenerate_and_lonely_vertices_get_zero() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5]], np.float32)
    triangles = np.array([[0, 1, 2]], np.int32)
    assert (face_normals(points, triangles) == 0).all()
    assert (vertex_normals(points, triangles) == 0).all()
    assert face_areas(points, triangles)[0] == 0


def test_far_from_the_origin_keeps_its_digits() -> None:
    points, triangles = _sphere()
    far = points + np.float32([4096, 0, -4096])
    moved_back = (far.astype(np.float64) - [4096, 0, -4096]).astype(np.float32)
    np.testing.assert_allclose(vertex_normals(far, triangles), vertex_normals(moved_back, triangles), atol=1e-6)


def test_after_a_move_they_are_those_of_the_whole_mesh_to_the_last_bit() -> None:
    points, triangles = _sphere()
    mesh = Mesh(
        points=points, counts=np.full(len(triangles), 3, np.int32), corners=triangles.reshape(-1),
        parts=np.zeros(len(triangles), np.int32), part_names=("ball",),
    )
    known = points, mesh_normals(mesh)
    for share in (0.0, 0.002, 0.1, 1.0):
        rng = np.random.default_rng(int(share * 1000))
        moved = points + np.where(rng.random((len(points), 1)) < share, rng.normal(0, 0.1, points.shape), 0)
        now = moved.astype(np.float32)
        again = mesh_normals(mesh, now, known)
        assert np.array_equal(again, mesh_normals(mesh, now))
        known = now, again


def test_far_from_what_moved_nothing_is_made_anew() -> None:
    """Normals that are wrong beforehand stay so out of reach of the vertex that moved."""
    points, triangles = _sphere()
    mesh = Mesh(
        points=points, counts=np.full(len(triangles), 3, np.int32), corners=triangles.reshape(-1),
        parts=np.zeros(len(triangles), np.int32), part_names=("ball",),
    )
    now = points.copy()
    now[5] *= np.float32(1.2)
    found = mesh_normals(mesh, now, (points, np.full_like(points, 7.0)))
    around = np.unique(triangles[(triangles == 5).any(axis=1)])
    assert set(np.flatnonzero((found != 7.0).all(axis=1))) == set(around)
