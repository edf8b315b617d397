"""Keys and clips of the timeline."""

from __future__ import annotations

from tests.documents import animated_document, small_document
from tools.frames import clip_range, keyed_frames


def test_keys_of_every_number_of_a_coat_are_found_once() -> None:
    assert keyed_frames(small_document()) == ()
    assert keyed_frames(animated_document()) == (1001.0, 1010.0, 1030.0)


def test_a_mesh_without_a_clip_has_no_range() -> None:
    assert clip_range(small_document()) is None
