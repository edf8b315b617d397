"""Numbers in text mean what Python says they mean."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.errors import UserError
from core.formats.text_numbers import numbers, text_bytes


@given(st.lists(st.floats(width=32, allow_nan=False), min_size=1, max_size=20))
def test_nine_digits_give_back_the_same_float32(values):
    text = " ".join(f"{v:.9g}" for v in values).encode()
    np.testing.assert_array_equal(numbers(text)[0].astype(np.float32), np.array(values, np.float32))


@given(st.from_regex(r"[+-]?([0-9]{1,25}\.?[0-9]{0,25}|\.[0-9]{1,25})([eE][+-]?[0-9]{1,3})?", fullmatch=True))
def test_any_decimal_agrees_with_python(word):
    value, truth = numbers(word.encode())[0][0], float(word)
    assert value == truth or math.isclose(value, truth, rel_tol=1e-14) or abs(truth) < 1e-300


@pytest.mark.parametrize("word", ["", "nan", "abc", "1.#IND", "12abc", "0x10", "--1", "1..2", "e5", "."])
def test_what_is_no_number_is_nan(word):
    assert np.isnan(numbers(f"1 {word} 2".encode())[0][1:-1]).all()


def test_the_odd_ways_to_write_one():
    words = b"1. .5 +3 -0 1e2 1E+2 2d3 3.1+2 1,5 inf -Infinity"
    np.testing.assert_array_equal(numbers(words)[0], [1, 0.5, 3, 0, 100, 100, 2000, 310, 1, 5, np.inf, -np.inf])


def test_lines_of_any_ending_are_told_apart():
    values, lines = numbers(b"1 2\r\n\r\n3\r4\n5")
    np.testing.assert_array_equal(values, [1, 2, 3, 4, 5])
    np.testing.assert_array_equal(lines, [0, 0, 2, 3, 4])


@pytest.mark.parametrize("codec", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_marked_encodings_become_utf8(codec):
    assert text_bytes("v 1 ü".encode(codec), "a.obj") == "v 1 ü".encode()


def test_broken_utf16_is_refused():
    with pytest.raises(UserError, match=r"a\.obj is broken text"):
        text_bytes(b"\xff\xfe\x00\xd8", "a.obj")
