"""Rows compared as bits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from core.rows import bytes_of_rows, changed_rows, flip_rows, row_change

DTYPES = st.sampled_from([np.float32, np.float64, np.int32, np.uint8, np.bool_, np.int16])


@st.composite
def pairs(draw):
    dtype = draw(DTYPES)
    shape = draw(hnp.array_shapes(min_dims=1, max_dims=3, min_side=1, max_side=9))
    old = draw(hnp.arrays(dtype, shape))
    new = old.copy()
    for row in draw(st.lists(st.integers(0, shape[0] - 1), max_size=4)):
        new[row] = draw(hnp.arrays(dtype, shape[1:]))
    return old, new


@given(pairs())
def test_rows_are_those_whose_bytes_differ(pair):
    old, new = pair
    truth = [i for i in range(len(old)) if old[i].tobytes() != new[i].tobytes()]
    assert changed_rows(old, new).tolist() == truth


@given(pairs())
def test_a_change_leads_both_ways_to_the_bit(pair):
    old, new = pair
    change = row_change(old, new)
    there, back = old.copy(), new.copy()
    flip_rows(there, change)
    flip_rows(back, change)
    assert there.tobytes() == new.tobytes()
    assert back.tobytes() == old.tobytes()


def test_minus_zero_is_a_change_and_nan_equals_itself():
    old = np.array([[0.0, 1.0], [np.nan, 2.0], [3.0, 4.0]], np.float32)
    new = old.copy()
    new[0, 0] = -0.0
    assert changed_rows(old, new).tolist() == [0]


def test_read_only_and_unaligned_arrays_are_compared_too():
    data = bytes(1) + np.arange(40, dtype=np.float32).tobytes()
    old = np.frombuffer(data, np.float32, offset=1).reshape(10, 4)
    new = old.copy()
    new[7, 2] += 1
    assert not old.flags.aligned
    assert changed_rows(old, new).tolist() == [7]


def test_other_shapes_and_types_are_refused():
    a = np.zeros((3, 2), np.float32)
    for b in (np.zeros((4, 2), np.float32), np.zeros((3, 2), np.int32)):
        with pytest.raises(ValueError, match="same shape and dtype"):
            changed_rows(a, b)


def test_empty_arrays_have_no_rows():
    a, b = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    assert len(changed_rows(a, b)) == 0
    assert bytes_of_rows(a).shape[0] == 0
    assert len(changed_rows(np.zeros((3, 0), np.float32), np.ones((3, 0), np.float32))) == 0
