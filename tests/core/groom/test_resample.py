from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.resample import arc_fractions, arc_lengths, sample_at, stretched, with_point_count
from tests.core.groom.small_grooms import fur, mixed

CORNER = np.array([[[0, 0, 0], [3, 0, 0], [3, 4, 0]]], np.float32)


def test_points_at_arc_lengths_of_a_corner():
    assert np.array_equal(arc_lengths(CORNER), [[0, 3, 7]])
    assert np.allclose(arc_fractions(CORNER), [[0, 3 / 7, 1]])
    at = sample_at(CORNER, np.array([[0.0, 1.5, 3.0, 5.0, 9.0]]))
    assert np.allclose(at, [[[0, 0, 0], [1.5, 0, 0], [3, 0, 0], [3, 2, 0], [3, 6, 0]]])


def test_segments_of_no_length_are_passed_over():
    p = np.array([[[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]]], np.float32)
    assert np.allclose(sample_at(p, np.array([[0, 0.5, 1.5]])), [[[0, 0, 0], [0.5, 0, 0], [1.5, 0, 0]]])
    assert np.array_equal(sample_at(p[:, :1].repeat(3, axis=1), np.array([[0, 1.0]])), np.zeros((1, 2, 3)))
    assert np.allclose(arc_fractions(np.zeros((1, 3, 3), np.float32)), [[0, 0.5, 1]])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.05, 4))
def test_stretched_strands_have_the_length_asked_for(seed, factor):
    rng = np.random.default_rng(seed)
    p = np.cumsum(rng.normal(0, 0.1, (5, 9, 3)), axis=1).astype(np.float32)
    wanted = arc_lengths(p)[:, -1] * factor
    out = stretched(p, wanted)
    assert np.allclose(arc_lengths(out)[:, -1], wanted, rtol=1e-5)
    assert np.allclose(arc_fractions(out), arc_fractions(p), atol=1e-4)
    assert np.array_equal(out[:, 0], p[:, 0])


def test_a_straight_strand_stretches_along_itself():
    g = fur()
    out = stretched(g.points, np.full(len(g), 0.9))
    assert np.allclose(out - g.points[:, :1], (g.points - g.points[:, :1]) * (0.9 / 0.4), atol=1e-6)


def test_another_number_of_points_keeps_ends_lengths_and_hold():
    g = mixed(5)
    more = with_point_count(g, 45)  # every old point is a new one: 44 = 4 * 11
    assert np.allclose(more.points[:, ::4], g.points, atol=1e-6)
    assert np.allclose(more.hold[:, ::4], g.hold, atol=1e-5)
    assert np.array_equal(more.hold[:, ::4] == 1, g.hold == 1)
    back = with_point_count(more, 12)
    assert np.allclose(back.points, g.points, atol=1e-6)
    assert np.array_equal(back.points[:, 0], g.points[:, 0])
    assert with_point_count(g, 12) is g
    with pytest.raises(ValueError, match="2 points"):
        with_point_count(g, 1)
