"""The desk: what panels hear of strokes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from tests.tools.scenes import document, pointers, sight
from tools.document_edits import add_empty_groom
from tools.session import Session


@pytest.fixture
def desk(qapp: object) -> Iterator[Desk]:
    desk = Desk(Session(document()))
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


def test_what_a_stroke_picks_is_heard_once_and_another_stroke_says_nothing(desk: Desk, qtbot: QtBot) -> None:
    heard: list[tuple[object, object]] = []
    desk.workspace_changed.connect(lambda old, new: heard.append((old.params.get("clone"), new.params.get("clone"))))
    desk.session.choose("clone")
    places = desk.session.hand._grounds(sight(), desk.session.tool)[0].screen
    (press,) = pointers([places.pixels[np.flatnonzero(places.seen)[0], 6]])
    desk.session.hand.press(sight(), press)
    with qtbot.waitSignal(desk.stroke_ended):
        desk.end_stroke()
    assert len(heard) == 1
    before, after = heard[0]
    assert not before or not before["source"]  # type: ignore[index]
    assert len(after["source"]) == 1  # type: ignore[index]
    assert after is desk.workspace.params["clone"]
    desk.session.choose("comb")
    desk.session.hand.press(sight(), press)
    desk.end_stroke()
    assert len(heard) == 1


def test_undo_of_the_groom_in_hand_goes_back_to_another(desk: Desk) -> None:
    """What is shown, what is edited and what tools stand on stay one groom; redo comes back to the one chosen."""
    first = desk.groom
    assert first is not None
    assert desk.edit("Add groom", add_empty_groom, desk.document.meshes[0].id)
    desk.set_workspace(groom=desk.document.grooms[-1].id)
    desk.session.undo()
    assert desk.groom is first
    assert desk.session.groom is first
    desk.session.redo()
    assert desk.groom is desk.session.groom is desk.document.grooms[-1]
