"""Clips on the timeline."""

from __future__ import annotations

from tests.documents import small_document
from tools.frames import clip_range


def test_a_mesh_without_a_clip_has_no_range() -> None:
    assert clip_range(small_document()) is None
