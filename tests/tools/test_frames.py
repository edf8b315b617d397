"""Range, rate and keys of the timeline."""

from __future__ import annotations

import pytest

from core.document import Document
from core.errors import UserError
from tests.documents import animated_document, small_document
from tools.frames import clip_range, keyed_frames, with_range, with_rate


def test_a_range_is_put_in_order_and_held_within_what_frames_there_are() -> None:
    document = Document()
    assert (with_range(document, 5, -3).first_frame, with_range(document, 5, -3).last_frame) == (-3, 5)
    assert with_range(document, document.first_frame, document.last_frame) is document
    with pytest.raises(UserError, match="Frames go from"):
        with_range(document, 0, 2**31)


def test_a_rate_is_one_something_plays_at() -> None:
    document = Document()
    assert with_rate(document, 25).fps == 25.0
    assert with_rate(document, 24.0) is document
    for rate in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(UserError, match="frames per second"):
            with_rate(document, rate)


def test_keys_of_every_number_of_a_coat_are_found_once() -> None:
    assert keyed_frames(small_document()) == ()
    assert keyed_frames(animated_document()) == (1001.0, 1010.0)


def test_a_mesh_without_a_clip_has_no_range() -> None:
    assert clip_range(small_document()) is None
