"""Numbers out of text, fast: the one number parser of the text formats (OBJ, PLY, STL, OFF)."""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.errors import UserError

BYTES = types.Array(types.uint8, 1, "C", readonly=True)
MARKS = (
    (b"\xff\xfe\x00\x00", "utf-32"),
    (b"\x00\x00\xfe\xff", "utf-32"),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
)
POWERS = 10.0 ** np.arange(23)  # exact in float64, so mantissa times power is rounded once


def text_bytes(data: bytes, name: str) -> bytes:
    """The text of a file as UTF-8 (or any 8-bit) bytes: UTF-16 and UTF-32 with a mark are converted.

    Raises UserError when the marked text is broken.
    """
    for mark, codec in MARKS:
        if data.startswith(mark):
            try:
                return data.decode(codec).encode("utf-8")
            except UnicodeError:
                raise UserError(f"{name} is broken text (it says {codec.upper()}); export it again.") from None
    return data[3:] if data.startswith(b"\xef\xbb\xbf") else data


def numbers(text: bytes) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """All blank-separated words of `text` as numbers.

    Returns
    -------
    values : (N,) float64, NaN for a word that is no number.
    lines : (N,) int32, the line each word stands on, from 0.
    """
    data = np.frombuffer(text, np.uint8)
    values = np.empty(_count_words(data), np.float64)
    lines = np.empty(len(values), np.int32)
    _read_words(data, POWERS, values, lines)
    return values, lines


@njit(types.float64(BYTES, types.int64, types.int64, types.Array(types.float64, 1, "C", readonly=True)),
      cache=True, nogil=True)  # fmt: skip
def parse_number(data, start, stop, powers):  # type: ignore[no-untyped-def]
    """The number written in data[start:stop], NaN when it is none. Exact to the last bit up to 15 digits."""
    at = start
    sign = 1.0
    if at < stop and (data[at] == 43 or data[at] == 45):
        if data[at] == 45:
            sign = -1.0
        at += 1
    mantissa = np.uint64(0)
    digits = 0
    exponent = 0
    seen = False
    dot = False
    while at < stop:
        c = data[at]
        if 48 <= c <= 57:
            seen = True
            if digits < 18:
                mantissa = mantissa * np.uint64(10) + np.uint64(c - 48)
                if mantissa > 0:
                    digits += 1
                if dot:
                    exponent -= 1
            elif not dot:
                exponent += 1
        elif c == 46 and not dot:
            dot = True
        else:
            break
        at += 1
    if not seen:
        if stop - at >= 3 and (data[at] | 32) == 105 and (data[at + 1] | 32) == 110 and (data[at + 2] | 32) == 102:
            return sign * np.inf
        return np.nan
    if at < stop and (data[at] | 32 == 101 or data[at] | 32 == 100 or data[at] == 43 or data[at] == 45):
        if data[at] != 43 and data[at] != 45:  # "3.1e+2", Fortran's "3.1d2" and the mangled "3.1+2"
            at += 1
        down = False
        if at < stop and (data[at] == 43 or data[at] == 45):
            down = data[at] == 45
            at += 1
        power = 0
        while at < stop and 48 <= data[at] <= 57:
            power = min(power * 10 + (data[at] - 48), 10000)
            at += 1
        exponent += -power if down else power
    if at < stop:  # a stray word such as "1.#IND" or "12abc"
        return np.nan
    value = np.float64(mantissa)
    if mantissa == 0:
        return sign * 0.0
    if -22 <= exponent < 0:
        value /= powers[-exponent]
    elif exponent < -300:
        value = value * 1e-300 * 10.0 ** max(exponent + 300, -300)
    elif exponent < 0:
        value *= 10.0**exponent
    elif exponent <= 22:
        value *= powers[exponent]
    else:
        value *= 10.0 ** min(exponent, 400)
    return sign * value


@njit(types.UniTuple(types.int64, 2)(BYTES, types.int64, types.int64), cache=True, nogil=True)  # type: ignore[no-untyped-call]
def next_word(data, at, end):  # type: ignore[no-untyped-def]
    """Where the first word in data[at:end] starts and stops; both `end` when there is none."""
    while at < end and data[at] <= 32:
        at += 1
    start = at
    while at < end and data[at] > 32:
        at += 1
    return start, at


@njit(types.int64(BYTES, types.int64), cache=True, nogil=True)
def end_of_line(data, at):  # type: ignore[no-untyped-def]
    """The first line feed or carriage return at or behind `at`, or the end."""
    while at < len(data) and data[at] != 10 and data[at] != 13:
        at += 1
    return at


@njit(types.int64(BYTES), cache=True, nogil=True)
def _count_words(data):  # type: ignore[no-untyped-def]
    count = 0
    blank = True
    for c in data:
        now = c <= 32 or c == 44
        if blank and not now:
            count += 1
        blank = now
    return count


@njit(
    types.void(
        BYTES, types.Array(types.float64, 1, "C", readonly=True), types.Array(types.float64, 1, "C"),
        types.Array(types.int32, 1, "C"),
    ),
    cache=True, nogil=True,
)  # fmt: skip
def _read_words(data, powers, values, lines):  # type: ignore[no-untyped-def]
    size = len(data)
    at = 0
    row = 0
    line = 0
    while at < size:
        c = data[at]
        if c <= 32 or c == 44:
            if c == 10 or (c == 13 and not (at + 1 < size and data[at + 1] == 10)):
                line += 1
            at += 1
            continue
        stop = at + 1
        while stop < size and data[stop] > 32 and data[stop] != 44:
            stop += 1
        values[row] = parse_number(data, at, stop, powers)
        lines[row] = line
        row += 1
        at = stop
