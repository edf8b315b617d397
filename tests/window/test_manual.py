"""The manual is true: its made parts are those of the program, its example works, its first groom can be followed."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.window.screenshot import window_image
from docs.first_groom import SIZE, STEPS, picture_of
from docs.manual import written
from tests.tools import scenes
from tests.window.alone import hand_at
from tests.window.conftest import OFFSCREEN
from tests.window.take_pictures import reduced
from tools.registry import Registry
from tools.session import Session

DOCS = Path(__file__).parents[2] / "docs"
MANUAL = (DOCS / "groom.md").read_text("utf-8")
GUIDES = 2752  # after the steps; the width of letters moves the strokes by a pixel or two


def test_tables_and_steps_are_those_of_the_program() -> None:
    assert written(MANUAL) == MANUAL, "make pictures"


def test_every_picture_of_the_manual_is_there() -> None:
    named = re.findall(r"\]\((pictures/[^)]+)\)", MANUAL)
    assert len(named) >= len(STEPS)
    for name in named:
        assert (DOCS / name).is_file(), name


def test_the_studios_tool_of_the_manual_irons_hair(tmp_path: Path) -> None:
    example = next(code for code in re.findall(r"```python\n(.*?)```", MANUAL, re.DOTALL) if "Tool[" in code)
    (tmp_path / "iron.py").write_text(example)
    registry = Registry(folders=(tmp_path,))
    assert registry.troubles == []
    session = Session(scenes.document(), evaluator=scenes.EVALUATOR, tools=registry)
    way = scenes.line((150, 190), (250, 210))
    session.choose("comb")
    session.hand.stroke(scenes.sight(), way)
    combed = bends(scenes.guides_of(session).points)
    session.choose("iron", heat=1.0)
    session.hand.stroke(scenes.sight(), way)
    assert session.history.undo_name == "Iron"
    assert bends(scenes.guides_of(session).points) < 0.97 * combed


def bends(points: np.ndarray) -> float:
    """Sum of the second differences along all strands."""
    return float(np.linalg.norm(np.diff(points, n=2, axis=1), axis=2).sum())


@pytest.mark.timeout(400)
def test_the_first_groom_followed_literally_makes_its_picture(home: Path, qapp: object) -> None:
    if OFFSCREEN is not None:
        pytest.skip(OFFSCREEN)
    hand = hand_at(None, SIZE)
    session = None
    for step in STEPS:
        step.do(hand, home)
        session = hand.window.desk.session
        if step.title == "Undo":
            assert session.history.redo_name == "Comb"
        elif step.made:
            assert session.history.undo_name == step.made[-1], step.title
    assert session is not None
    made = [name for step in STEPS for name in step.made]
    assert list(session.history.names)[1:] == made
    groom = session.document.grooms[0]
    assert len(groom.guides) == pytest.approx(GUIDES, rel=0.02)
    assert groom.guides.hold.max() > 0.5
    saved = Session.open(home / "first.filo")
    assert np.array_equal(saved.document.grooms[0].guides.points, groom.guides.points)
    hand.finish()
    image = reduced(window_image(hand.window), 0.75)
    kept = cv2.imread(str(DOCS / "pictures" / picture_of(len(STEPS))))
    assert image.shape == kept.shape
    half = [cv2.resize(i, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA).astype(float) for i in (image, kept)]
    assert np.abs(half[0] - half[1]).mean() < 3.0
    hand.window.close_unasked()
