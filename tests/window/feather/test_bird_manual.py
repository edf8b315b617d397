"""The walk-through of docs/feather.md is that of the program, and can be followed."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.first_bird import FOLDED, OPEN, SIZE, STEPS, chapter, picture_of
from tests.window.alone import hand_at
from tests.window.conftest import OFFSCREEN

DOCS = Path(__file__).parents[3] / "docs"


def test_the_chapter_is_that_of_the_steps() -> None:
    assert chapter() in (DOCS / "feather.md").read_text("utf-8"), "make pictures"
    for number in range(1, len(STEPS) + 1):
        assert (DOCS / "pictures" / picture_of(number)).is_file()


@pytest.mark.timeout(500)
def test_the_goldfinch_followed_literally(home: Path, qapp: object) -> None:
    if OFFSCREEN is not None:
        pytest.skip(OFFSCREEN)
    hand = hand_at(None, SIZE)
    made: list[str] = []
    for step in STEPS:
        step.do(hand, home)
        made += step.made
        assert list(hand.window.desk.session.history.names)[1:] == made, step.title
    coat = hand.window.desk.document.feathers[0]
    assert [tract.name for tract in coat.tracts] == ["cap"]
    assert [wing.name for wing in coat.wings] == ["left wing", "right wing", "tail"]
    fan = coat.wings[2].fan.base
    assert [(key.frame, pytest.approx(key.value)) for key in fan.keys] == [(FOLDED, 0.7), (OPEN, 1.5)]
    quill = next(row for row in coat.wings[0].rows if row.name == "primaries").offsets[0]
    assert quill.number == 9
    assert quill.spread.base.number == pytest.approx(0.2094, abs=1e-3)  # 12 degrees
    hand.window.close_unasked()
