"""Meshes laid flat: which edges are borders, and that a map is where its skin is."""

from __future__ import annotations

import numpy as np
import pytest

from app.uv_layout import MOST_INNER, flat_map, grey, uv_layout, value_at
from core.groom.groom import Map
from core.groom.maps import sample_image
from core.record import freeze
from tests.documents import grid_mesh


def test_the_border_of_a_sheet_is_its_rim() -> None:
    layout = uv_layout(grid_mesh(4))
    assert len(layout.borders) == 16
    assert len(layout.inner) == 2 * 4 * 3
    on_rim = np.isclose(layout.borders, 0.0) | np.isclose(layout.borders, 1.0)
    assert np.all((on_rim[:, 0] & on_rim[:, 2]) | (on_rim[:, 1] & on_rim[:, 3]))


def test_a_seam_makes_borders() -> None:
    mesh = grid_mesh(2)
    assert mesh.uvs is not None
    moved = mesh.uvs.copy()
    moved[:4] += 5.0  # the first face is an island of its own
    layout = uv_layout(mesh.replace(uvs=freeze(moved)))
    assert len(layout.borders) == 4 + 8
    assert len(layout.inner) == 2
    assert np.sum(np.all(layout.borders > 4.0, axis=1)) == 4


def test_edges_of_huge_meshes_are_left_to_the_borders() -> None:
    assert len(uv_layout(grid_mesh(200)).inner) == 0 < MOST_INNER
    assert len(uv_layout(grid_mesh(200)).borders) == 800


def test_vertex_values_lie_under_their_faces() -> None:
    mesh = grid_mesh(8)
    assert mesh.uvs is not None
    small = mesh.replace(uvs=freeze(0.5 * mesh.uvs))  # the lower left quarter
    height = mesh.points[:, 2].astype(np.float32)  # equals v of the full layout
    flat = flat_map(Map(name="height", values=height), small)
    for u, v in ((0.1, 0.1), (0.2, 0.4), (0.45, 0.3)):
        found = value_at(flat, u, v)
        assert found == pytest.approx(2.0 * v, abs=0.5 / 8 + 0.01)
    assert value_at(flat, 0.7, 0.2) is None
    assert value_at(flat, 0.2, 0.7) is None
    assert value_at(flat, 1.2, -0.2) is None


def test_an_image_is_read_as_the_coat_reads_it() -> None:
    mesh = grid_mesh(2)
    image = np.random.default_rng(1).random((5, 7)).astype(np.float32)
    flat = flat_map(Map(name="noise", image=image), mesh)
    uv = np.array([[(x + 0.5) / 7, 1.0 - (y + 0.5) / 5] for y in range(5) for x in range(7)], np.float32)
    expected = sample_image(image, uv)
    assert [value_at(flat, u, v) for u, v in uv.tolist()] == pytest.approx(expected.tolist(), abs=1e-5)


def test_grey_levels_reach_from_black_to_white() -> None:
    values = np.array([[0.0, 0.5, 1.0], [np.nan, 2.0, -2.0]], np.float32)
    flat = flat_map(Map(name="a", image=np.nan_to_num(values)), grid_mesh(1))._replace(values=values)
    pixels = grey(flat, (1, 2, 3))
    assert pixels[1, 0].tolist() == [1, 2, 3]
    assert pixels[1, 1].tolist() == [255] * 3
    assert pixels[1, 2].tolist() == [0] * 3
    assert pixels[0, 0, 0] == 128
    assert grey(flat._replace(values=values[:1]), (1, 2, 3))[0, :, 0].tolist() == [0, 128, 255]
    assert max(grey(flat._replace(values=np.zeros((10, 5000), np.float32)), (0, 0, 0)).shape) <= 2048
