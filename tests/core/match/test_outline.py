"""Masks and outlines, by areas and places known beforehand."""

import numpy as np
import pytest

from core.errors import UserError
from core.match.outline import Mask, curve_through, filled, held_off, key_mask, outline_at, unkey_mask

SQUARE = np.array([[10.0, 10.0], [30.0, 10.0], [30.0, 20.0], [10.0, 20.0]])
MASK = Mask(id=1, name="bar", frames=np.array([10, 20], np.int32), points=np.stack((SQUARE, SQUARE + 10.0)))


def test_a_polygon_holds_off_the_pixels_inside_it():
    inside = filled(SQUARE, False, 40, 50)
    assert inside[10:21, 10:31].all()
    assert inside.sum() == 21 * 11
    assert held_off((), 3, 40, 50) is None
    inverted = held_off((MASK.replace(inverted=True),), 10, 40, 50)
    np.testing.assert_array_equal(inverted, ~inside)


def test_a_mask_moves_straight_between_its_keys_and_waits_outside_of_them():
    for frame, shift in ((3, 0.0), (10, 0.0), (13, 3.0), (20, 10.0), (99, 10.0)):
        np.testing.assert_allclose(outline_at(MASK, frame), SQUARE + shift)
    keyed = key_mask(MASK, 15, SQUARE - 4.0)
    np.testing.assert_allclose(outline_at(keyed, 12.5), SQUARE - 2.0)
    assert unkey_mask(keyed, 15).frames.tolist() == [10, 20]
    with pytest.raises(UserError):
        key_mask(MASK, 15, SQUARE[:3])
    with pytest.raises(UserError):
        unkey_mask(unkey_mask(MASK, 10), 20)


def test_a_curve_goes_through_its_points_and_near_the_circle_they_lie_on():
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    points = 50.0 + 30.0 * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    curve = curve_through(points)
    np.testing.assert_allclose(curve[::8], points, atol=1e-9)
    assert np.abs(np.linalg.norm(curve - 50.0, axis=1) - 30.0).max() < 0.15
    assert abs(filled(points, True, 100, 100).sum() - np.pi * 900.0) < 120


def test_outlines_far_outside_fill_what_they_cover():
    assert filled(np.array([[-1e9, -1e9], [1e9, -1e9], [1e9, 1e9], [-1e9, 1e9]]), False, 20, 20).all()
    assert not filled(SQUARE + 1e9, False, 20, 20).any()
