"""The walk-throughs of docs/match.md stand there as their steps say it, with their pictures."""

from pathlib import Path
from types import ModuleType

import pytest

from docs import first_solve, first_track

DOCS = Path(__file__).parents[3] / "docs"


@pytest.mark.parametrize("steps", [first_track, first_solve])
def test_the_chapter_is_that_of_the_steps(steps: ModuleType) -> None:
    assert steps.chapter() in (DOCS / "match.md").read_text("utf-8"), "make pictures"
    for number in range(1, len(steps.STEPS) + 1):
        assert (DOCS / "pictures" / steps.picture_of(number)).is_file()
