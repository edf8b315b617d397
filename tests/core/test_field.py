"""Fields as a panel meets them."""

from typing import Annotated

import msgspec
import pytest

from core.field import field, fields_of
from core.record import Record


class Brush(Record):
    size: Annotated[float, field("Size", "How far the brush reaches, in pixels.", "px", (4, 400), (1, 4000))] = 70.0
    hidden: int = 3
    mode: Annotated[str, field("Mode", "What it does.", choices=("a", "b"))] = "a"


def test_only_described_fields_are_found_in_their_order() -> None:
    found = fields_of(Brush)
    assert list(found) == ["size", "mode"]
    size = found["size"]
    assert (size.unit, size.soft, size.label) == ("px", (4, 400), "Size")
    assert found["mode"].choices == ("a", "b")


def test_a_preset_outside_the_hard_range_is_refused_by_name() -> None:
    assert msgspec.json.decode(b'{"size": 3999}', type=Brush).size == 3999
    with pytest.raises(msgspec.ValidationError, match=r"\$\.size"):
        msgspec.json.decode(b'{"size": 4001}', type=Brush)


def test_an_unknown_unit_is_a_fault_of_the_program() -> None:
    with pytest.raises(ValueError, match="unit"):
        field("Size", "words", "furlong")
