"""Edits of wings: named in sentences where they cannot be, everything else untouched."""

from __future__ import annotations

import numpy as np
import pytest

from core.demo.bird_document import bare_bird_document
from core.document import Document
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.plumage import Plumage
from core.feather.coat.wing import first_id
from core.value import constant
from tools.feather_edits import add_feathers, promote_feather, set_feathers
from tools.keyed import keyed_values
from tools.wing_edits import (
    add_wings,
    find_row,
    find_wing,
    remove_wings,
    reset_wing_feather,
    set_row,
    set_wing,
    set_wing_feather,
)


@pytest.fixture(scope="module")
def document() -> Document:
    return add_feathers(bare_bird_document(), 1, 150, Evaluator(), keys=20)


def test_a_bird_that_is_dressed_has_its_wings_and_they_go_and_come_back(document: Document) -> None:
    coat = document.feathers[0]
    assert len(coat.wings) == 3
    without = remove_wings(document, coat.id)
    assert without.feathers[0].wings == ()
    assert without.feathers[0].placements is coat.placements
    again = add_wings(without, coat.id).feathers[0]
    for one, other in zip(again.wings, coat.wings, strict=True):
        assert [row.name for row in one.rows] == [row.name for row in other.rows]
        np.testing.assert_array_equal(one.rows[0].places, other.rows[0].places)


def test_a_feather_is_keyed_and_given_back(document: Document) -> None:
    coat = document.feathers[0]
    changed = set_wing_feather(document, coat.id, 0, 2, 9, spread=constant(0.2))
    row = find_row(find_wing(changed.feathers[0], 0), 2)
    assert [offset.number for offset in row.offsets] == [9]
    twice = set_wing_feather(changed, coat.id, 0, 2, 9, bend=constant(0.1))
    offset = find_row(find_wing(twice.feathers[0], 0), 2).offsets[0]
    assert offset.spread is row.offsets[0].spread
    back = reset_wing_feather(twice, coat.id, 0, 2, 9)
    assert find_row(find_wing(back.feathers[0], 0), 2).offsets == ()
    assert find_wing(changed.feathers[0], 1) is find_wing(coat, 1)


def test_what_cannot_be_is_said(document: Document) -> None:
    coat = document.feathers[0]
    for edit, words in (
        (lambda: set_row(document, coat.id, 0, 2, lift=constant(9.0)), "cannot be set"),
        (lambda: set_row(document, coat.id, 0, 2, colour=1), "has no colour"),
        (lambda: set_row(document, coat.id, 0, 77), "no row 77"),
        (lambda: set_wing(document, coat.id, 9), "no wing 9"),
        (lambda: set_wing_feather(document, coat.id, 0, 2, 10), "9 feathers"),
        (lambda: add_wings(set_feathers(document, coat.id, locked=True), coat.id), "locked"),
    ):
        with pytest.raises(UserError, match=words):
            edit()
    bare = document.replace(meshes=(document.meshes[0].replace(rig=None),))
    with pytest.raises(UserError, match="has no rig"):
        add_wings(bare, coat.id)


def test_what_is_keyed_on_a_wing_is_found_with_the_other_curves(document: Document) -> None:
    from core.curve import Curve, Key
    from core.value import Value

    coat = document.feathers[0]
    fan = Value(base=Curve(keys=(Key(frame=1001.0, value=0.5), Key(frame=1010.0, value=1.0))))
    found = keyed_values(set_wing(document, coat.id, 2, fan=fan))
    assert [one.address for one in found] == [f"feathers/{coat.id}/wings/2/fan"]


def test_a_feather_of_a_wing_is_no_proxy(document: Document) -> None:
    coat = document.feathers[0]
    with pytest.raises(UserError, match="under Wings"):
        promote_feather(document, coat.id, first_id(coat.wings[0], coat.wings[0].rows[0]), Plumage(Evaluator()), 1001.0)
