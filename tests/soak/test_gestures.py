"""5,000 random gestures at the real window: whatever the hand does, the document is whole and nothing hangs."""

from __future__ import annotations

import os

import numpy as np
import pytest
from PySide6.QtCore import Qt

from core.document import Document, problems
from tests.window.conftest import OFFSCREEN, Opened, animal, evaluator, home, opened  # noqa: F401 (fixtures)
from tests.window.hand import ALT, CTRL, LEFT, MIDDLE, NONE, RIGHT, SHIFT, Hand

GESTURES = int(os.environ.get("FILOPLUME_GESTURES", "5000"))
KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_F, Qt.Key.Key_Return, Qt.Key.Key_4, Qt.Key.Key_Home, Qt.Key.Key_BracketLeft)
TOOLS = ("comb", "smooth", "length", "cut", "plant", "hairspray", "wash", "select", "freeze", "clone")


@pytest.mark.skipif(OFFSCREEN is not None, reason=str(OFFSCREEN))
def test_random_gestures(opened: Opened, animal: Document) -> None:  # noqa: F811
    hand, rng = opened(animal), np.random.default_rng(4)
    session = hand.window.desk.session
    for _ in range(GESTURES):
        _gesture(hand, rng)
        assert hand.view.gestures.drag is None or not session.stroking or hand.view.gestures.stroke is not None
        assert problems(session.document) == []
        for groom in session.document.grooms:
            assert np.isfinite(groom.guides.points).all()
    hand.key(Qt.Key.Key_Escape)
    assert not session.stroking
    assert session.document is session.history.current
    hand.finish()


def _gesture(hand: Hand, rng: np.random.Generator) -> None:
    start, end = rng.uniform(0.2, 0.8, 2), rng.uniform(0.2, 0.8, 2)
    a, b = (float(start[0]), float(start[1])), (float(end[0]), float(end[1]))
    kind = rng.integers(8)
    if kind < 4:
        hand.drag(a, b, LEFT, (NONE, NONE, SHIFT, CTRL)[rng.integers(4)], steps=3)
    elif kind == 4:
        hand.drag(a, b, MIDDLE, (NONE, SHIFT, CTRL, ALT)[rng.integers(4)], steps=2)
    elif kind == 5:
        hand.press(a)
        hand.key(KEYS[rng.integers(len(KEYS))])
        hand.move(b)
        hand.release(b, (LEFT, LEFT, RIGHT)[rng.integers(3)])
        hand.release(b)
    elif kind == 6:
        hand.key(KEYS[rng.integers(len(KEYS))])
    else:
        name = TOOLS[rng.integers(len(TOOLS))]
        hand.window.commands.run(("edit.undo", "edit.redo", f"tool.{name}")[rng.integers(3)])
