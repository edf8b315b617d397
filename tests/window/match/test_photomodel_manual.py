"""The walk-through of docs/model.md stands there as its steps say it, with their pictures."""

from pathlib import Path

from docs.first_photomodel import STEPS, chapter, picture_of

DOCS = Path(__file__).parents[3] / "docs"


def test_the_chapter_is_that_of_the_steps() -> None:
    assert chapter() in (DOCS / "model.md").read_text("utf-8"), "make pictures"
    for number in range(1, len(STEPS) + 1):
        assert (DOCS / "pictures" / picture_of(number)).is_file()
