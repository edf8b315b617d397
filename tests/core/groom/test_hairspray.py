from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.comb import comb
from core.groom.hairspray import spray, wash
from tests.core.groom.small_grooms import fur, mixed, view


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31), st.floats(0, 2), st.floats(0, 1), st.floats(0, 1))
def test_only_hold_changes_and_only_where_allowed(seed, amount, a, b):
    before = mixed(seed)
    w = np.random.default_rng(seed).random(before.hold.shape)
    for call, sign in ((spray, 1), (wash, -1)):
        after = call(before, amount, w, min(a, b), max(a, b))
        assert after.points is before.points
        assert after.ids is before.ids
        assert after.hold.min() >= 0
        assert after.hold.max() <= 1
        assert (sign * (after.hold - before.hold) >= 0).all()
        shut = before.frozen | (~before.selected & before.selected.any())
        assert np.array_equal(after.hold[shut], before.hold[shut])


def test_sprayed_by_the_weight_along_a_part_of_the_strand():
    g = fur()  # straight, 12 points: t = i / 11
    w = np.linspace(0, 1, len(g))
    after = spray(g, 0.5, w, 0.25, 0.75)
    t = np.arange(12) / 11
    assert np.allclose(after.hold, 0.5 * w[:, None] * ((t >= 0.25) & (t <= 0.75)), atol=1e-6)
    assert np.allclose(wash(after, 0.25).hold, np.maximum(after.hold - 0.25, 0))
    assert np.array_equal(wash(spray(g)).hold, g.hold)
    assert wash(g) is g


def test_sprayed_hair_holds_against_the_comb_and_washed_hair_moves_again():
    g, v, path = fur(), view(), [[120, 150], [280, 230]]
    moved = np.abs(comb(g, v, path, 120).points - g.points).max(axis=(1, 2))
    assert comb(spray(g), v, path, 120) is spray(g) or np.array_equal(comb(spray(g), v, path, 120).points, g.points)
    half = np.abs(comb(spray(g, 0.7), v, path, 120).points - g.points).max(axis=(1, 2))
    assert 0.05 * moved.sum() < half.sum() < 0.8 * moved.sum()
    assert np.array_equal(comb(wash(spray(g)), v, path, 120).points, comb(g, v, path, 120).points)
