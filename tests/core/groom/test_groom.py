"""The records of a groom."""

import numpy as np
import pytest

from core.groom.groom import Coat, Map
from core.value import constant
from tests.documents import small_document


@pytest.mark.parametrize(
    "changes",
    [
        {"count": -1}, {"count": 10**9}, {"density": 1.5}, {"clump": -0.1}, {"frizz": float("nan")}, {"points": 1},
        {"width_root": -1e-5}, {"width_tip": float("inf")}, {"color_tip": (0.1, 0.2, -0.3)}, {"seed": 2**32},
        {"length_variation": 2.0},
    ],
)  # fmt: skip
def test_coats_refuse_what_cannot_be(changes):
    with pytest.raises(ValueError, match=f"Coat.{next(iter(changes))} must be a finite number"):
        Coat(**changes)


def test_the_usual_coat_is_allowed_and_its_length_is_a_value():
    assert Coat().length.base.number == 1.0
    assert Coat(length=constant(2.0)).length.base.number == 2.0


def test_a_map_is_either_by_vertex_or_an_image():
    values, image = np.zeros(4, np.float32), np.zeros((2, 3), np.float32)
    assert Map(name="a", values=values).values.flags.writeable is False
    assert Map(name="a", image=image).image.shape == (2, 3)
    for given in ({}, {"values": values, "image": image}):
        with pytest.raises(ValueError, match="either values"):
            Map(name="a", **given)
    for bad in (np.zeros((2, 2), np.float64), np.full((2, 2), np.nan, np.float32), np.zeros((0, 2), np.float32)):
        with pytest.raises(ValueError, match=r"Map\.image"):
            Map(name="a", image=bad)


def test_a_groom_has_the_maps_its_coat_names():
    groom = small_document().grooms[0]
    assert groom.map("density") is groom.maps[0]
    assert groom.map("ghost") is None
    with pytest.raises(ValueError, match="ghost"):
        groom.replace(coat=groom.coat.replace(length_map="ghost"))
    with pytest.raises(ValueError, match="two maps"):
        groom.replace(maps=groom.maps * 2)
    for name in ("", "a\nb", "x" * 256):
        with pytest.raises(ValueError, match=r"Groom\.name"):
            groom.replace(name=name)
