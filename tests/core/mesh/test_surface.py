import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from core.mesh.mesh import Mesh, Triangles
from core.mesh.roots import Roots
from core.mesh.surface import (
    Carried,
    place_roots,
    rest_from_posed,
    rest_from_posed_again,
    root_frames,
    root_normals,
    root_positions,
    strands_on_deformed,
)
from core.workers import Workers


def _skin(uvs: bool = True) -> tuple[Mesh, Triangles]:
    """A tilted grid of quads with rolling hills, UVs from x and z."""
    n = 9
    x, z = np.meshgrid(np.linspace(0, 2, n), np.linspace(0, 2, n))
    points = np.stack([x, 0.2 * np.sin(2 * x) * np.cos(3 * z), z], -1).reshape(-1, 3).astype(np.float32)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    quads = np.stack([i, i + n, i + n + 1, i + 1], 1).astype(np.int32)  # normals towards +y
    corners = quads.ravel()
    mesh = Mesh(
        points=points, counts=np.full(len(quads), 4, np.int32), corners=corners,
        uvs=points[corners][:, [0, 2]] / 2 if uvs else None,
        parts=np.zeros(len(quads), np.int32), part_names=("hill",),
    )
    q = np.arange(len(quads), dtype=np.int32)
    local = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    tri_corners = (4 * q[:, None, None] + local).reshape(-1, 3)
    return mesh, Triangles(vertices=corners[tri_corners], corners=tri_corners, faces=np.repeat(q, 2))


def _roots(mesh: Mesh, triangles: Triangles, count: int = 500) -> tuple[Roots, np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)
    index = random.integers(0, len(triangles.faces), count).astype(np.int32)
    weights = random.dirichlet((1, 1, 1), count).astype(np.float32)
    return place_roots(mesh, triangles, index, weights), index, weights


@pytest.mark.parametrize("uvs", [True, False])
def test_frames_are_orthonormal_and_right_handed(uvs: bool) -> None:
    mesh, triangles = _skin(uvs)
    roots, _, _ = _roots(mesh, triangles)
    frames = roots.frames.astype(np.float64)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frames.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-6)
    assert (frames[:, 2, 1] > 0.5).all()  # normals up


def test_places_and_uvs_are_those_of_the_triangle() -> None:
    mesh, triangles = _skin()
    roots, index, weights = _roots(mesh, triangles)
    wanted = (mesh.points[triangles.vertices[index]].astype(np.float64) * weights[:, :, None]).sum(1)
    places = root_positions(mesh, roots)
    np.testing.assert_allclose(places, wanted, atol=1e-6)
    np.testing.assert_allclose(roots.uvs, places[:, [0, 2]] / 2, atol=1e-6)
    assert (roots.faces == triangles.faces[index]).all()


def test_the_tangent_runs_with_u() -> None:
    mesh, triangles = _skin()
    roots, index, _ = _roots(mesh, triangles)
    corner = mesh.points[triangles.vertices[index]].astype(np.float64)
    uv = mesh.uvs[triangles.corners[index]].astype(np.float64)
    # solve for the gradient of position over u in each triangle: independent of the kernel's formula
    for row in range(0, len(index), 25):
        edges_uv = uv[row, 1:] - uv[row, 0]
        along_u = np.linalg.solve(edges_uv, corner[row, 1:] - corner[row, 0])[0]
        normal = roots.frames[row, 2].astype(np.float64)
        along_u -= normal * (along_u @ normal)
        np.testing.assert_allclose(roots.frames[row, 0], along_u / np.linalg.norm(along_u), atol=1e-5)


@pytest.mark.parametrize("uvs", [True, False])
def test_a_rigid_motion_carries_strands_rigidly(uvs: bool) -> None:
    mesh, triangles = _skin(uvs)
    roots, _, _ = _roots(mesh, triangles)
    turn = Rotation.from_rotvec([0.4, 2.0, -1.1]).as_matrix()
    moved = (mesh.points @ turn.T + [3, -1, 0.5]).astype(np.float32)
    random = np.random.default_rng(2)
    strands = (root_positions(mesh, roots)[:, None] + random.normal(size=(500, 6, 3)) * 0.2).astype(np.float32)
    strands[:, 0] = root_positions(mesh, roots)
    carried = strands_on_deformed(mesh, roots, strands, moved)
    np.testing.assert_allclose(carried, strands @ turn.T + [3, -1, 0.5], atol=3e-6)
    np.testing.assert_array_equal(carried[:, 0], root_positions(mesh, roots, moved))
    np.testing.assert_allclose(root_normals(mesh, roots, moved), roots.frames[:, 2] @ turn.T, atol=1e-6)


def test_any_deformation_keeps_roots_on_the_skin_and_lengths() -> None:
    mesh, triangles = _skin()
    roots, index, weights = _roots(mesh, triangles)
    moved = (mesh.points * [1.5, 1, 0.6] + np.sin(mesh.points[:, [2, 0, 1]] * 3) * 0.2).astype(np.float32)
    strands = np.repeat(root_positions(mesh, roots)[:, None], 5, 1)
    strands += (np.arange(5)[:, None] * np.float32(0.1) * roots.frames[:, 2][:, None]).astype(np.float32)
    carried = strands_on_deformed(mesh, roots, strands, moved)
    on_skin = (moved[triangles.vertices[index]].astype(np.float64) * weights[:, :, None]).sum(1)
    np.testing.assert_allclose(carried[:, 0], on_skin, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(np.diff(carried, axis=1), axis=2), 0.1, atol=1e-5)
    along = (carried[:, -1] - carried[:, 0]) / 0.4
    np.testing.assert_allclose(along, root_normals(mesh, roots, moved), atol=1e-5)


@pytest.mark.parametrize("uvs", [True, False])
@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (1.5, 1.0, 0.6), (0.4, 2.0, 1.3)])
@pytest.mark.parametrize("seed", range(4))
def test_posed_strands_go_back_to_rest_and_rest_to_posed(uvs: bool, stretch: tuple, seed: int) -> None:
    mesh, triangles = _skin(uvs)
    roots, _, _ = _roots(mesh, triangles)
    random = np.random.default_rng(seed)
    moved = mesh.points * stretch + np.sin(mesh.points[:, [2, 0, 1]] * 3) * 0.1 * seed
    moved = (moved @ Rotation.random(random_state=seed).as_matrix().T + [0.3, -1, 0.5]).astype(np.float32)
    diagonal = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    strands = (root_positions(mesh, roots)[:, None] + random.normal(size=(500, 6, 3)) * 0.2).astype(np.float32)
    strands[:, 0] = root_positions(mesh, roots)
    back = rest_from_posed(mesh, roots, strands_on_deformed(mesh, roots, strands, moved), moved)
    assert np.abs(back - strands).max() < 1e-6 * diagonal
    np.testing.assert_array_equal(back[:, 0], strands[:, 0])
    # and what was edited there stands there again
    edited = strands_on_deformed(mesh, roots, strands, moved)
    edited[:, 1:] += (random.normal(size=(500, 5, 3)) * 0.1).astype(np.float32)
    again = strands_on_deformed(mesh, roots, rest_from_posed(mesh, roots, edited, moved), moved)
    assert np.abs(again - edited).max() < 1e-6 * diagonal


def test_only_what_changed_since_the_last_preview_is_carried_back() -> None:
    mesh, triangles = _skin()
    roots, _, _ = _roots(mesh, triangles)
    random = np.random.default_rng(1)
    skin = (mesh.points @ Rotation.random(random_state=1).as_matrix().T).astype(np.float32)
    roots_at_rest = root_positions(mesh, roots)
    strands = (roots_at_rest[:, None] + random.normal(size=(500, 6, 3)) * 0.2).astype(np.float32)
    strands[:, 0] = roots_at_rest
    start = Carried(strands_on_deformed(mesh, roots, strands, skin), strands)
    frames = root_frames(mesh, roots, skin), roots.frames
    # rows that nothing can have made by carrying: the last preview's are kept where nothing moved since
    last = Carried(start.posed + np.float32(1), np.full_like(strands, 7))
    now = last.posed.copy()
    edited, undone = np.arange(100, 200), np.arange(300, 320)
    now[edited, 1:] += np.float32(0.25)
    now[undone] = start.posed[undone]
    workers = Workers(3)
    found = rest_from_posed_again(now, last, start, *frames, lambda n, call: workers.ranges(n, call, 50))
    workers.close()
    np.testing.assert_array_equal(found, rest_from_posed_again(now, last, start, *frames))
    carried = rest_from_posed(mesh, roots, now, skin)
    np.testing.assert_allclose(found[edited, 1:], carried[edited, 1:], atol=1e-5)
    np.testing.assert_array_equal(found[edited, 0], strands[edited, 0])
    np.testing.assert_array_equal(found[undone], strands[undone])
    kept = np.delete(np.arange(500), np.concatenate([edited, undone]))
    np.testing.assert_array_equal(found[kept], last.rest[kept])


def test_rest_is_rest() -> None:
    mesh, triangles = _skin()
    roots, _, _ = _roots(mesh, triangles)
    assert root_frames(mesh, roots) is roots.frames
    np.testing.assert_allclose(root_frames(mesh, roots, mesh.points), roots.frames, atol=2e-6)


def test_a_collapsed_skin_still_gives_frames() -> None:
    mesh, triangles = _skin()
    roots, _, _ = _roots(mesh, triangles)
    for moved in (np.zeros_like(mesh.points), mesh.points * np.float32([1, 0, 0])):
        frames = root_frames(mesh, roots, moved).astype(np.float64)
        np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-5)


def test_turning_upside_down_is_a_half_turn() -> None:
    ball = trimesh.creation.icosphere(2)
    points, faces = ball.vertices.astype(np.float32), ball.faces.astype(np.int32)
    mesh = Mesh(
        points=points, counts=np.full(len(faces), 3, np.int32), corners=faces.ravel(),
        parts=np.zeros(len(faces), np.int32), part_names=("ball",),
    )
    triangles = Triangles(
        vertices=faces, corners=np.arange(faces.size, dtype=np.int32).reshape(-1, 3),
        faces=np.arange(len(faces), dtype=np.int32),
    )
    roots = place_roots(
        mesh, triangles, np.arange(len(faces), dtype=np.int32), np.full((len(faces), 3), 1 / 3, np.float32)
    )
    assert np.isfinite(roots.frames).all()
    np.testing.assert_allclose(np.linalg.det(roots.frames.astype(np.float64)), 1, atol=1e-6)
    flipped = points * np.float32([1, -1, -1])
    np.testing.assert_allclose(
        root_frames(mesh, roots, flipped), roots.frames * np.float32([1, -1, -1]), atol=2e-6
    )


def test_a_query_that_found_nothing_is_refused() -> None:
    mesh, triangles = _skin()
    with pytest.raises(ValueError, match="found none"):
        place_roots(mesh, triangles, np.array([-1], np.int32), np.zeros((1, 3), np.float32))
