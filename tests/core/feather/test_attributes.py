"""The attributes, presets and dials of a feather."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import UserError
from core.feather.attributes import ATTRIBUTES, COLUMNS, NAMES, SHAPE_NAMES, column, defaults, limits
from core.feather.attributes_of_form import SHAPE_ROWS
from core.feather.compare import blend
from core.feather.dials import DIAL_NAMES, DIALS, columns_of, turned
from core.feather.presets import (
    KINDS,
    bird_names,
    bird_values,
    decoded,
    load_bird,
    load_preset,
    preset_names,
    preset_values,
)
from core.field import UNITS


def test_there_are_over_two_hundred_attributes_each_described_once() -> None:
    assert len(ATTRIBUTES) > 200
    assert len(set(NAMES)) == len(NAMES)
    for known in ATTRIBUTES:
        assert known.low <= known.default <= known.high
        assert known.low < known.high
        assert known.unit in UNITS
        assert known.description.endswith(".")
        assert len(known.description.split()) >= 4
    for name in ("shaftLength", "shaftRadius", "vaneWidthLeft", "vaneWidthRight", "downHairDensityVaneRight"):  # course
        assert name in COLUMNS


def test_sides_are_neighbours_and_the_shape_comes_first() -> None:
    for name in NAMES:
        if name.endswith("Left"):
            assert COLUMNS[name[:-4] + "Right"] == COLUMNS[name] + 1 == column(name[:-4] + "*") + 1
    assert NAMES[: len(SHAPE_NAMES)] == SHAPE_NAMES
    assert len(SHAPE_NAMES) > len(SHAPE_ROWS)


def test_every_preset_is_read_and_every_kind_and_bird_is_there() -> None:
    low, high = limits()
    kinds = {load_preset(name).kind for name in preset_names()}
    assert kinds == set(KINDS)
    assert len(preset_names()) >= 12
    for name in preset_names():
        values = preset_values(name)
        assert np.all((values >= low) & (values <= high))
    assert set(bird_names()) == {"goldfinch", "peregrine", "owl", "duck"}
    for bird in bird_names():
        for part in load_bird(bird).feathers:
            assert bird_values(bird, part).shape == (len(NAMES),)
        assert np.array_equal(bird_values(bird, "no such part"), bird_values(bird, "body"))


@pytest.mark.parametrize(("data", "said"), [
    (b"{", "not a feather preset"), (b"[]", "not a feather preset"), (b"\xff\xfe", "not a feather preset"),
    (b'{"title": "a", "kind": "leaf", "attributes": {}}', "kind of a feather"),
    (b'{"title": "a", "kind": "down", "attributes": {"scales": 1}}', "no attribute"),
    (b'{"title": "a", "kind": "down", "attributes": {"barbCount": 1e9}}', "goes from"),
    (b'{"title": "a", "kind": "down", "attributes": {"barbCount": "all"}}', "not a feather preset"),
])  # fmt: skip
def test_a_broken_preset_is_refused_in_a_sentence(data: bytes, said: str) -> None:
    with pytest.raises(UserError, match=said):
        decoded(data, "mine.json")
    with pytest.raises(UserError, match="There is no feather"):
        preset_values("leaf")
    with pytest.raises(UserError, match="There is no bird"):
        load_bird("bat")


def test_dials_name_attributes_there_are_and_keep_to_the_ranges() -> None:
    assert len(DIALS) >= 12
    assert len(set(DIAL_NAMES)) == len(DIALS)
    start = preset_values("owl-contour")
    low, high = limits()
    for dial in DIALS:
        assert np.array_equal(turned(start, **{dial.name: 0.0}), start)
        for position in (-1.0, 1.0):
            values = turned(start, **{dial.name: position})
            changed = set(np.flatnonzero(values != start).tolist())
            assert changed
            assert changed <= {c for effect in dial.effects for c in columns_of(effect.name)}
            assert np.all((values >= low) & (values <= high))
    with pytest.raises(ValueError, match="dials are"):
        turned(start, fluf=0.1)


def test_a_blend_is_each_of_its_ends_and_lies_between() -> None:
    first, second = preset_values("owl-contour"), preset_values("peregrine-primary")
    assert np.array_equal(blend(first, second, 0.0), first)
    assert np.array_equal(blend(first, second, 1.0), second)
    half = blend(first, second, 0.5)
    assert np.all(half >= np.minimum(first, second) - 1e-4)
    assert np.all(half <= np.maximum(first, second) + 1e-4)
    assert defaults().dtype == np.float32
