"""The records of a groom."""

import numpy as np
import pytest

from core.curve import Curve, Key
from core.errors import UserError
from core.groom.groom import COAT_FIELDS, COAT_VALUES, Coat, Map
from core.value import Value, constant, formula
from tests.documents import small_document


@pytest.mark.parametrize(
    "changes",
    [
        {"count": -1}, {"count": 10**9}, {"density": constant(1.5)}, {"clump": constant(-0.1)}, {"points": 1},
        {"width_root": constant(-1e-5)}, {"width_tip": constant(2e3)}, {"color_tip": (0.1, 0.2, -0.3)},
        {"seed": 2**32}, {"length_variation": constant(2.0)}, {"length": constant(-1.0)},
    ],
)  # fmt: skip
def test_coats_refuse_what_cannot_be(changes):
    with pytest.raises(ValueError, match=f"Coat.{next(iter(changes))} must be a finite number"):
        Coat(**changes)


def test_what_an_artist_animates_is_a_value_and_nothing_else():
    values = {name for name, field in Coat.__annotations__.items() if "[Value," in field}
    assert values == set(COAT_VALUES)
    assert Coat().length.base.number == 1.0
    assert Coat(clump=constant(0.5)).clump.base.number == 0.5
    for name in COAT_VALUES:
        with pytest.raises(ValueError, match=rf"Coat\.{name} must be a Value"):
            Coat(**{name: 0.5})


def test_a_value_beyond_its_range_is_refused_only_when_it_is_always_beyond():
    Coat(clump=constant(3.0, "wet"), frizz=formula("frame"), density=Value(base=Curve(keys=(Key(frame=1, value=9),))))


def test_every_field_of_a_coat_says_what_a_panel_needs():
    assert list(COAT_FIELDS) == list(Coat.__struct_fields__)
    for name, known in COAT_FIELDS.items():
        assert known.label, name
        assert len(known.tooltip.split()) >= 8, name
        assert known.tooltip.endswith("."), name
        if name in COAT_VALUES or name in ("count", "seed", "points"):
            low, high = known.hard
            assert low <= known.soft[0] < known.soft[1] <= high, name
    assert COAT_FIELDS["width_root"].unit == COAT_FIELDS["width_tip"].unit == "m"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"clump": formula("0.2 + dnsity")}, "Clump: Column 7 of the expression: .* 'dnsity'; did you mean 'density'"),
        ({"frizz": formula("t")}, "Frizz: Column 1 of the expression: there is no value named 't'"),
        ({"width_tip": constant(1e-4, "ghost")}, "Width at the tip: There is no map named 'ghost'; paint or load it"),
        ({"density": constant(1.0, "u")}, "Density: There is no map named 'u'"),
    ],
)  # fmt: skip
def test_a_groom_refuses_values_that_read_what_is_not_there(changes, sentence):
    groom = small_document().grooms[0]
    with pytest.raises(UserError, match=sentence) as error:
        groom.replace(coat=groom.coat.replace(**changes))
    assert isinstance(error.value, ValueError)  # decoding adds the path of the field


def test_a_groom_offers_the_frame_the_id_the_uv_and_its_maps():
    groom = small_document().grooms[0]
    groom.replace(coat=groom.coat.replace(clump=formula("frame + id + u + v + density", "density")))


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
