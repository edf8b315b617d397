"""Morton codes beside a bit-by-bit interleaving."""

from __future__ import annotations

import numpy as np
import pytest

from core.mesh.morton import morton_codes


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("bits", [1, 5, 10])
def test_bits_of_the_three_axes_take_turns(kind: type, bits: int) -> None:
    low, high = np.array([-1.0, 0.0, 2.0]), np.array([3.0, 1.0, 4.0])
    places = np.random.default_rng(bits).uniform(low - 0.1, high + 0.1, (500, 3)).astype(kind)
    cells = np.clip((places.astype(np.float64) - low) / 4.0 * (2**bits - 1), 0, 2**bits - 1).astype(int)
    for cell, code in zip(cells, morton_codes(places, low, high, bits), strict=True):
        words = [format(n, "010b") for n in cell[::-1]]
        assert int("".join(z + y + x for z, y, x in zip(*words, strict=True)), 2) == code


def test_places_that_are_not_finite_and_a_box_without_size_have_codes_within_the_box() -> None:
    places = np.array([[np.nan, np.inf, -np.inf], [0.5, 0.5, 0.5]], np.float32)
    assert (morton_codes(places, np.zeros(3), np.ones(3), 4) < 4096).all()
    assert (morton_codes(places, np.full(3, 0.5), np.full(3, 0.5), 4) < 4096).all()
