"""The history panel: what it lists, and that going through it is undo."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QPoint, Qt
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.history_panel import HistoryPanel, in_bytes
from tests.documents import small_document, stroked
from tools.session import Session


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session(small_document()))
    for number, name in enumerate(("Plant", "Comb", "Cut", "Comb")):
        desk.edit(name, stroked, number)
    yield desk
    desk.jobs.close()
    desk.session.close(discard=True)


@pytest.fixture
def panel(desk: Desk, qtbot: QtBot) -> HistoryPanel:
    panel = HistoryPanel(desk)
    qtbot.addWidget(panel)
    panel.resize(240, 300)
    with qtbot.waitExposed(panel):
        panel.show()
    return panel


def shown(panel: HistoryPanel) -> list[str]:
    model = panel.steps
    return [model.data(model.index(row)) for row in range(model.rowCount())]


def click(panel: HistoryPanel, qtbot: QtBot, row: int) -> None:
    place = panel.list.visualRect(panel.steps.index(row)).center()
    qtbot.mouseClick(panel.list.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(place))


def test_it_lists_the_steps_newest_first_and_follows_undo(desk: Desk, panel: HistoryPanel) -> None:
    assert shown(panel) == ["Comb", "Cut", "Comb", "Plant", "New"]
    assert panel.list.currentIndex().row() == 0
    desk.session.undo()
    assert panel.list.currentIndex().row() == 1
    desk.edit("Smooth", stroked, 9)
    assert shown(panel) == ["Smooth", "Cut", "Comb", "Plant", "New"]
    assert panel.list.currentIndex().row() == 0


def test_a_click_goes_to_any_step_and_back(desk: Desk, panel: HistoryPanel, qtbot: QtBot) -> None:
    last = desk.document
    click(panel, qtbot, 3)
    assert desk.session.history.cursor == 1
    assert desk.session.history.undo_name == "Plant"
    model = panel.steps
    dim, plain = (model.data(model.index(row), Qt.ItemDataRole.ForegroundRole) for row in (0, 4))
    assert dim != plain
    click(panel, qtbot, 0)
    assert desk.document is last
    qtbot.keyClick(panel.list, Qt.Key.Key_Down)
    assert desk.session.history.cursor == 3


def test_it_is_still_during_a_stroke_and_looks_again_after(
    desk: Desk, panel: HistoryPanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Session, "stroking", True)
    desk.edit("Stroke", stroked, 7)
    assert shown(panel)[0] == "Comb"
    monkeypatch.undo()
    desk.stroke_ended.emit()
    assert shown(panel)[0] == "Stroke"


def test_the_foot_says_steps_and_memory(desk: Desk, panel: HistoryPanel, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: panel.foot.text() == f"4 steps · {in_bytes(desk.session.history.bytes)}")
    desk.replace_session(Session(small_document()))
    assert shown(panel) == ["New"]
    qtbot.waitUntil(lambda: panel.foot.text().startswith("0 steps"))


def test_a_thousand_steps_are_listed(desk: Desk, panel: HistoryPanel) -> None:
    session = Session(small_document())
    for number in range(1000):
        session.commit(f"Step {number}", session.document.replace())
    desk.replace_session(session)
    assert panel.steps.rowCount() == 1001
    assert panel.list.visualRect(panel.steps.index(0)).intersects(panel.list.viewport().rect())


@pytest.mark.parametrize(("count", "words"), [
    (0, "0 B"), (1023, "1023 B"), (1536, "1.5 kB"), (10 << 20, "10 MB"), (3 << 30, "3.0 GB")])
def test_bytes_in_words(count: int, words: str) -> None:
    assert in_bytes(count) == words
