from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.chain import first_free, read_chain, rebuild_chain, write_chain


def scratch(count):
    return np.empty((count, 3)), np.empty((count - 1, 3)), np.empty(count - 1)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.floats(-3, 0), st.floats(0, 50))
def test_lengths_do_not_drift_when_a_strand_is_turned_again_and_again(seed, log_length, offset):
    rng = np.random.default_rng(seed)
    points = (rng.normal(0, 10**log_length / 8, (1, 8, 3)).cumsum(axis=1) + offset).astype(np.float32)
    x, q, lengths = scratch(8)
    start = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=-1)[0]
    quantum = 0.0
    for _ in range(200):
        quantum = read_chain(points, 0, x, q, lengths)
        q += rng.normal(0, 0.5, q.shape)
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        rebuild_chain(x, q, lengths, 0)
        write_chain(points, 0, x, lengths, 0, quantum)
    after = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=-1)[0]
    # half a quantum of reading, half of the last writing; never 200 of them
    assert np.abs(after - start).max() <= 1.01 * quantum


def test_a_quantum_is_the_float32_step_at_the_strand():
    points = np.array([[[1.5, 0, 0], [1.6, 0, 0], [1.7, 0, 0]]], np.float32)
    x, q, lengths = scratch(3)
    assert read_chain(points, 0, x, q, lengths) == np.spacing(np.float32(1.7))
    assert np.allclose(q, [[1, 0, 0]] * 2)
    assert np.allclose(lengths, 0.1, atol=2e-7)


def test_segments_of_no_length_take_the_direction_beside_them():
    points = np.array([[[0, 0, 0], [0, 0, 0], [0, 1, 0], [0, 1, 0]]], np.float32)
    x, q, lengths = scratch(4)
    read_chain(points, 0, x, q, lengths)
    assert np.array_equal(q, [[0, 1, 0]] * 3)
    assert np.array_equal(lengths, [0, 1, 0])
    read_chain(np.ones((1, 4, 3), np.float32), 0, x, q, lengths)
    assert np.array_equal(np.linalg.norm(q, axis=1), [1, 1, 1])


def test_freedom_is_that_of_the_stiffest_point_carried():
    hold = np.array([[0, 0.2, 1, 0.5, 0.25], [0, 0, 0, 0, 1], [1, 0, 0, 0, 0]], np.float32)
    freedom = np.empty(4)
    assert first_free(hold, 0, freedom) == 2
    assert np.allclose(freedom, [0, 0, 0.5, 0.75])
    assert first_free(hold, 1, freedom) == 4  # a locked tip locks all
    assert first_free(hold, 2, freedom) == 0  # the root never moves anyway
    assert np.array_equal(freedom, np.ones(4))
