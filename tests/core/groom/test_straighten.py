"""Strands stretch out."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.straighten import straighten
from core.record import freeze
from tests.core.groom.small_grooms import ball, fur, mixed, radial_depth, segment_lengths, stays


def bent():
    guides = fur()
    points = guides.points.copy()
    along = np.linspace(0.0, 6.0, points.shape[1])
    points[:, :, 1] += (0.05 * (np.sin(along) - np.sin(along[0]))).astype(np.float32)
    return guides.replace(points=freeze(points))


def test_free_strands_become_straight_and_keep_their_lengths():
    before = bent()
    after = straighten(before)
    stays(before, after)
    np.testing.assert_allclose(segment_lengths(after), segment_lengths(before), rtol=1e-5)
    reach = np.linalg.norm(after.points[:, -1] - after.points[:, 0], axis=1)
    np.testing.assert_allclose(reach, segment_lengths(after).sum(axis=1), rtol=1e-5)
    was = before.points[:, -1] - before.points[:, 0]
    now = after.points[:, -1] - after.points[:, 0]
    cosines = (was * now).sum(axis=1) / np.linalg.norm(was, axis=1) / np.linalg.norm(now, axis=1)
    assert cosines.min() > 0.9999


def test_half_straightens_half():
    before = bent()
    bends = []
    for guides in (before, straighten(before, 0.5), straighten(before)):
        steps = np.diff(guides.points.astype(np.float64), axis=1)
        steps /= np.linalg.norm(steps, axis=2, keepdims=True)
        bends.append(np.arccos(np.clip((steps[:, 1:] * steps[:, :-1]).sum(axis=2), -1.0, 1.0)).mean())
    assert bends[0] > 1.5 * bends[1] > 20.0 * bends[2]
    assert straighten(before, 0.0) is before


def test_a_loop_stands_up():
    guides = fur(2)
    points = guides.points.copy()
    turn = np.linspace(0.0, 2.0 * np.pi, points.shape[1])
    points[0] = points[0, 0] + 0.1 * np.stack([1.0 - np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    points[0, -1] = points[0, 0]
    after = straighten(guides.replace(points=freeze(points.astype(np.float32))))
    assert np.isfinite(after.points).all()


@given(st.integers(0, 10_000), st.floats(0.0, 1.0))
@settings(max_examples=25, deadline=None)
def test_what_is_held_frozen_or_not_selected_stays(seed, amount):
    before = mixed(seed, bent())
    after = straighten(before, amount, field=ball().field)
    stays(before, after)
    np.testing.assert_allclose(segment_lengths(after), segment_lengths(before), atol=2e-6)
    free = ~before.hold.any(axis=1)
    deeper = radial_depth(ball(), after.points[free]) - 0.01
    assert (deeper <= np.maximum(radial_depth(ball(), before.points[free]), 0.01)).all()
