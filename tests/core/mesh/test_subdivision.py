"""Truths: OpenSubdiv's own refined files; the limit of a cube; properties of stencils and UVs."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from core.mesh.mesh import Mesh
from core.mesh.subdivision import subdivide


def read_obj(path):
    points, faces = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
    return polygons(points, faces)


def polygons(points, faces, uvs=None):
    return Mesh(
        points=np.array(points, np.float32), counts=np.array([len(f) for f in faces], np.int32),
        corners=np.concatenate(faces).astype(np.int32), uvs=uvs, parts=np.arange(len(faces), dtype=np.int32) % 2,
        part_names=("a", "b"),
    )


def cube():
    points = [[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    return polygons(points, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])


@pytest.mark.parametrize("name", ["catmark_cube", "catmark_edgecorner"])
def test_agrees_with_opensubdiv(name):
    data = os.environ.get("FILOPLUME_DATA")
    if not data:
        pytest.skip("FILOPLUME_DATA is not set")
    folder = Path(data) / "meshes" / "opensubdiv_A"
    mesh = read_obj(folder / f"{name}_level0.obj")
    for level in (1, 2, 3):
        truth = read_obj(folder / f"{name}_level{level}.obj")
        mine = subdivide(mesh, level)[0]
        assert len(mine.points) == len(truth.points)
        assert len(mine.counts) == len(truth.counts)
        distance, nearest = cKDTree(mine.points).query(truth.points)
        assert distance.max() < 1e-6
        assert len(np.unique(nearest)) == len(truth.points)
        faces = {frozenset(f) for f in mine.corners.reshape(-1, 4).tolist()}
        assert faces == {frozenset(f) for f in nearest[truth.corners].reshape(-1, 4).tolist()}


def test_one_step_of_a_cube_in_closed_form():
    points = subdivide(cube())[0].points
    assert np.allclose(np.abs(points[:8]), 5 / 9)  # vertex rule of valence 3
    assert np.allclose(np.sort(np.abs(points[8:20]), axis=1), [0, 0.75, 0.75])
    assert np.allclose(np.sort(np.abs(points[20:]), axis=1), [0, 0, 1])


def test_winding_parts_and_closedness_are_kept():
    fine = subdivide(cube(), 3)[0]
    p = fine.points[fine.corners].reshape(-1, 4, 3)
    normals = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    assert np.all(np.sum(normals * p.mean(axis=1), axis=1) > 0)
    assert np.array_equal(fine.parts, np.repeat(cube().parts, 64))
    edges = np.stack([fine.corners.reshape(-1, 4), np.roll(fine.corners.reshape(-1, 4), -1, 1)], -1).reshape(-1, 2)
    assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}
    assert np.isfinite(fine.points).all()


def test_stencils_reproduce_points_and_affine_maps():
    mesh = cube()
    fine, stencils = subdivide(mesh, 2)
    assert np.allclose(stencils.sum(axis=1), 1)
    assert np.allclose(stencils @ mesh.points, fine.points, atol=1e-6)
    moved = mesh.replace(points=mesh.points * np.float32(2) + np.float32(3))
    assert np.allclose(subdivide(moved, 2)[0].points, fine.points * 2 + 3, atol=1e-5)
    same, identity = subdivide(mesh, 0)
    assert np.array_equal(same.points, mesh.points)
    assert identity.shape == (8, 8)


def test_boundary_is_the_cubic_b_spline_of_the_rim():
    """A strip whose rim is a polygon of many edges: the middle of the rim follows Lane and Riesenfeld's spline."""
    x = np.arange(9.0)
    y = np.sin(x)
    points = np.concatenate([np.c_[x, y, 0 * x], np.c_[x, y + 1, 0 * x]])
    mesh = polygons(points, [[i, i + 1, i + 10, i + 9] for i in range(8)])
    fine = subdivide(mesh)[0].points
    assert np.allclose(fine[1:8, 1], (y[:-2] + 6 * y[1:-1] + y[2:]) / 8, atol=1e-6)
    assert np.allclose(fine[[0, 8, 9, 17]], mesh.points[[0, 8, 9, 17]])


def test_uvs_stay_inside_their_face_and_seams_survive():
    uvs = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (6, 1))
    uvs += np.repeat(np.arange(6, dtype=np.float32) * 2, 4)[:, None] * [1, 0]
    mesh = cube().replace(uvs=uvs.astype(np.float32))
    fine = subdivide(mesh, 2)[0]
    island = fine.uvs.reshape(6, -1, 4, 2)
    for i in range(6):
        assert island[i, ..., 0].min() == 2 * i
        assert island[i, ..., 0].max() == 2 * i + 1
        q = island[i]
        area = 0.5 * np.abs((q[:, 2] - q[:, 0])[:, 0] * (q[:, 3] - q[:, 1])[:, 1]
                            - (q[:, 2] - q[:, 0])[:, 1] * (q[:, 3] - q[:, 1])[:, 0])
        assert np.allclose(area, 1 / 16)


def test_triangles_and_lonely_points():
    mesh = polygons([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], [[0, 1, 2]])
    fine = subdivide(mesh, 2)[0]
    assert np.all(fine.counts == 4)
    assert len(fine.counts) == 12
    assert np.array_equal(fine.points[3], [9, 9, 9])
    assert np.array_equal(fine.points[:3], mesh.points[:3])
