"""Hairs are lifted out of the skin: against a ball, whose inside is known in closed form, and a narrow crease."""

import numpy as np
import pytest
import trimesh

from core.groom.settle import inside_segments, settle, settle_exactly
from core.mesh.distance_field import build_distance_field
from core.mesh.signed_distance import build_signed_skin


@pytest.fixture(scope="module")
def ball():
    made = trimesh.creation.icosphere(subdivisions=4)
    points, triangles = np.asarray(made.vertices, np.float32), np.asarray(made.faces, np.int32)
    return points, build_distance_field(points, triangles), build_signed_skin(points, triangles)


def hairs_of(root: np.ndarray, direction: np.ndarray, length: float, points: int = 16) -> np.ndarray:
    """Straight hairs, (N, 3, P)."""
    along = np.linspace(0.0, length, points)
    return np.ascontiguousarray(root[:, :, None] + direction[:, :, None] * along, np.float32)


def slanting_hairs(points: np.ndarray, dip: float) -> np.ndarray:
    """Hairs from the vertices that lie along the skin and dip into it."""
    rng = np.random.default_rng(4)
    root = points[rng.choice(len(points), 300, replace=False)]
    tangent = np.cross(root, rng.normal(size=root.shape))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return hairs_of(root, tangent * np.cos(dip) - root * np.sin(dip), 0.4)


def lengths(hairs: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(hairs.astype(np.float64), axis=2), axis=1)


def test_dipping_hairs_come_out_with_their_lengths_and_roots(ball):
    points, field, skin = ball
    hairs = slanting_hairs(points, 0.5)
    before, roots = lengths(hairs), hairs[:, :, 0].copy()
    assert (np.linalg.norm(hairs[:, :, 5:], axis=1) < 0.99).any()
    assert settle(hairs, field) == len(hairs)
    assert np.linalg.norm(hairs[:, :, 2:], axis=1).min() > 0.998  # flat faces lie a little under the ball
    np.testing.assert_allclose(lengths(hairs), before, rtol=1e-4)
    np.testing.assert_array_equal(hairs[:, :, 0], roots)
    assert not inside_segments(hairs, field, skin, 1e-4).any()


def test_hairs_outside_are_left_to_the_bit(ball):
    points, field, skin = ball
    hairs = hairs_of(points[:200], points[:200], 0.3)
    same = hairs.copy()
    assert settle(hairs, field) == 0
    assert settle_exactly(hairs, field, skin, 1e-4) == 0
    np.testing.assert_array_equal(hairs, same)


def test_inside_segments_are_those_of_the_closed_form(ball):
    points, field, skin = ball
    hairs = hairs_of(points[::40], -points[::40], 0.5)  # straight in
    assert inside_segments(hairs, field, skin, 1e-4).all()
    through = hairs_of(points[::40], -points[::40], 2.5)  # and out on the other side after 2 of 2.5
    inside = inside_segments(through, field, skin, 1e-3)
    assert inside[:, :12].all()
    assert not inside[:, 13:].any()


def test_exact_settling_alone_frees_what_the_field_is_too_coarse_for(ball):
    points, _, skin = ball
    triangles = np.asarray(trimesh.creation.icosphere(subdivisions=4).faces, np.int32)
    coarse = build_distance_field(points, triangles, cell=0.2)
    hairs = slanting_hairs(points, 0.15)
    wrong = inside_segments(hairs, coarse, skin, 1e-4).any(axis=1)
    assert wrong.any()
    assert settle_exactly(hairs, coarse, skin, 1e-4) == wrong.sum()
    assert not inside_segments(hairs, coarse, skin, 1e-4).any()
    assert np.isfinite(hairs).all()


def test_a_hair_in_a_slit_too_narrow_for_it_still_ends_outside():
    block = trimesh.creation.box(extents=[1, 1, 1])
    left = block.copy().apply_translation([-0.5005, 0, 0])
    right = block.copy().apply_translation([0.5005, 0, 0])  # a slit 1 mm wide in a body of 2 m
    both = trimesh.util.concatenate([left, right])
    points, triangles = np.asarray(both.vertices, np.float32), np.asarray(both.faces, np.int32)
    field, skin = build_distance_field(points, triangles), build_signed_skin(points, triangles)
    rng = np.random.default_rng(0)
    root = np.stack([np.full(40, -0.0005), rng.uniform(-0.4, 0.4, 40), rng.uniform(-0.4, 0.4, 40)], axis=1)
    hairs = hairs_of(root, np.tile([1.0, 0.0, 0.0], (40, 1)), 0.3)  # straight across, deep into the other block
    assert inside_segments(hairs, field, skin, 1e-5).any()
    settle(hairs, field)
    settle_exactly(hairs, field, skin, 1e-5)
    assert not inside_segments(hairs, field, skin, 1e-5).any()
