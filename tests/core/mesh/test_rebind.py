import numpy as np
import pytest

from core.errors import UserError
from core.mesh.mesh import Mesh
from core.mesh.rebind import RebindMethod, rebind_roots
from core.mesh.roots import Roots
from core.mesh.scatter import scatter
from core.mesh.surface import place_roots, root_positions
from core.mesh.triangulate import triangulate


def _sheet(cells: int, uvs: bool, height: float = 0.0, mirrored: bool = False) -> Mesh:
    """A unit sheet of quads facing +y with UVs; `mirrored`: the half x < 0.5 is folded over the other in UV."""
    side = np.linspace(0, 1, cells + 1)
    x, z = np.meshgrid(side, side)
    points = np.stack([x, height * np.sin(3 * x) * z, z], -1).reshape(-1, 3).astype(np.float32)
    i = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    corners = np.stack([i, i + cells + 1, i + cells + 2, i + 1], 1).astype(np.int32).ravel()
    uv = points[corners][:, [0, 2]].copy()
    if mirrored:
        left = np.repeat(points[corners].reshape(-1, 4, 3)[:, :, 0].mean(1) < 0.5, 4)
        uv[left, 0] = 1 - uv[left, 0]
    return Mesh(
        points=points, counts=np.full(cells**2, 4, np.int32), corners=corners, uvs=uv if uvs else None,
        parts=np.zeros(cells**2, np.int32), part_names=("sheet",),
    )


def _roots(mesh: Mesh, count: int = 800) -> Roots:
    triangles = triangulate(mesh)
    return place_roots(mesh, triangles, *scatter(mesh.points, triangles.vertices, count))


def test_the_same_topology_keeps_every_root() -> None:
    old, new = _sheet(8, True), _sheet(8, True, height=0.3)
    roots = _roots(old)
    moved, method, error = rebind_roots(roots, old, new)
    assert (method == RebindMethod.TOPOLOGY).all()
    assert (error == 0).all()
    np.testing.assert_array_equal(moved.weights, roots.weights)
    np.testing.assert_allclose(root_positions(new, moved)[:, [0, 2]], root_positions(old, roots)[:, [0, 2]], atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(moved.frames.astype(np.float64)), 1, atol=1e-5)
    assert (np.abs(moved.frames - roots.frames).max((1, 2)) > 1e-3).any()  # frames of the new shape


def test_uvs_find_the_place_on_another_tessellation_however_it_has_moved() -> None:
    old, new = _sheet(8, True), _sheet(13, True)
    new = new.replace(points=new.points + np.float32([5, 1, 0]))
    roots = _roots(old)
    moved, method, error = rebind_roots(roots, old, new)
    assert (method == RebindMethod.UV).all()
    np.testing.assert_allclose(root_positions(new, moved) - [5, 1, 0], root_positions(old, roots), atol=2e-6)
    np.testing.assert_allclose(error, np.sqrt(26), rtol=1e-5)
    np.testing.assert_allclose(moved.uvs, roots.uvs, atol=1e-6)


def test_mirrored_halves_sharing_uvs_keep_their_sides() -> None:
    old, new = _sheet(8, True, mirrored=True), _sheet(12, True, mirrored=True)
    roots = _roots(old)
    moved, method, error = rebind_roots(roots, old, new)
    assert (method == RebindMethod.UV).mean() > 0.99
    assert error.max() < 1e-4
    np.testing.assert_allclose(root_positions(new, moved), root_positions(old, roots), atol=1e-4)


def test_without_uvs_the_closest_place_that_faces_the_same_way() -> None:
    """A thin plate: roots of its upper side, a hair nearer to the new lower side, stay up."""
    old = _sheet(8, False)
    upper, lower = _sheet(5, False), _sheet(5, False)
    n = len(upper.points)
    new = Mesh(
        points=np.concatenate([upper.points + np.float32([0, 0.002, 0]), lower.points - np.float32([0, 0.001, 0])]),
        counts=np.concatenate([upper.counts, lower.counts]),
        corners=np.concatenate([upper.corners, (lower.corners.reshape(-1, 4)[:, ::-1] + n).ravel()]),
        parts=np.concatenate([upper.parts, lower.parts]), part_names=("plate",),
    )
    moved, method, error = rebind_roots(_roots(old), old, new)
    assert (method == RebindMethod.CLOSEST).all()
    assert (moved.faces < len(upper.counts)).all()
    np.testing.assert_allclose(error, 0.002, atol=1e-5)


def test_where_nothing_faces_the_same_way_it_says_so() -> None:
    old = _sheet(4, False)
    new = _sheet(5, False)
    new = new.replace(corners=new.corners.reshape(-1, 4)[:, ::-1].copy().ravel())
    moved, method, error = rebind_roots(_roots(old, 50), old, new)
    assert (method == RebindMethod.CLOSEST_ANY).all()
    assert error.max() < 1e-6
    assert len(moved.faces) == 50


def test_roots_outside_every_island_go_by_place() -> None:
    old, new = _sheet(8, True), _sheet(9, True)
    assert new.uvs is not None
    new = new.replace(uvs=new.uvs * np.float32([0.5, 1]))
    roots = _roots(old)
    _, method, error = rebind_roots(roots, old, new)
    right = root_positions(old, roots)[:, 0] > 0.5
    assert (method[right] == RebindMethod.CLOSEST).all()
    assert error[right].max() < 1e-5
    assert (method[~right] == RebindMethod.UV).all()


def test_an_empty_mesh_is_refused() -> None:
    old = _sheet(2, False)
    empty = Mesh(
        points=np.zeros((0, 3), np.float32), counts=np.zeros(0, np.int32), corners=np.zeros(0, np.int32),
        parts=np.zeros(0, np.int32), part_names=(),
    )
    with pytest.raises(UserError, match="no faces"):
        rebind_roots(_roots(old, 5), old, empty)
