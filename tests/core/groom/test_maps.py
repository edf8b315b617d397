"""Maps against scipy's interpolation and closed forms."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from core.errors import UserError
from core.groom.maps import sample_image, sample_image_map, sample_vertex_map
from core.mesh.mesh import Mesh, Triangles


def square(uvs: bool = True) -> tuple[Mesh, Triangles]:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    corners = np.arange(4, dtype=np.int32)
    mesh = Mesh(
        points=points, counts=np.array([4], np.int32), corners=corners, parts=np.zeros(1, np.int32),
        part_names=("square",), uvs=points[:, :2].copy() if uvs else None,
    )
    two = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    return mesh, Triangles(vertices=two, corners=two, faces=np.zeros(2, np.int32))


def test_bilinear_agrees_with_scipy():
    rng = np.random.default_rng(3)
    image = rng.random((17, 23)).astype(np.float32)
    uv = rng.random((500, 2)).astype(np.float32)
    rows, columns = (1.0 - uv[:, 1].astype(float)) * 17 - 0.5, uv[:, 0].astype(float) * 23 - 0.5
    expected = map_coordinates(image.astype(float), [rows, columns], order=1, mode="grid-wrap")
    np.testing.assert_allclose(sample_image(image, uv), expected, atol=1e-6)


def test_the_top_row_of_the_image_is_v_one():
    image = np.zeros((4, 4), np.float32)
    image[0] = 1.0
    mesh, triangles = square()
    weights = np.array([[0.0, 0.1, 0.9]], np.float32)  # near corner 2 = (1, 1)
    value = sample_image_map(image, mesh, triangles, np.array([0], np.int32), weights)
    assert value[0] > 0.8


def test_vertex_maps_are_linear_on_the_surface():
    _, triangles = square()
    values = np.array([0.0, 2.0, 5.0, 3.0], np.float32)  # 2 x + 3 y
    rng = np.random.default_rng(0)
    weights = rng.dirichlet([1, 1, 1], 50).astype(np.float32)
    triangle = rng.integers(0, 2, 50).astype(np.int32)
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)[triangles.vertices[triangle]]
    at = np.einsum("nk,nkc->nc", weights, points)
    sampled = sample_vertex_map(values, triangles, triangle, weights)
    np.testing.assert_allclose(sampled, 2 * at[:, 0] + 3 * at[:, 1], atol=1e-5)


def test_an_image_without_uvs_is_refused_in_words():
    mesh, triangles = square(uvs=False)
    middle = np.full((1, 3), 1 / 3, np.float32)
    with pytest.raises(UserError, match="UVs"):
        sample_image_map(np.ones((2, 2), np.float32), mesh, triangles, np.zeros(1, np.int32), middle)
