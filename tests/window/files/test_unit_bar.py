"""A mesh whose file does not say its unit can be read in another one from the window, in place of itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QUrl
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.files.opening import Opening
from app.window.files.unit_bar import UnitBar
from tests.documents import small_document
from tools.session import Session

BOX = "v 0 0 0\nv 200 0 0\nv 200 0 300\nv 0 100 0\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"  # cm, as a file says nothing


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session())
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


def size_of(desk: Desk) -> list[float]:
    points = desk.document.meshes[-1].mesh.points
    return [round(float(side), 4) for side in points.max(axis=0) - points.min(axis=0)]


def test_unit_is_offered(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    file = tmp_path / "Katze 猫.obj"
    file.write_text(BOX)
    said: list[str] = []
    desk.said.connect(said.append)
    opening = Opening(desk)
    bar = UnitBar(desk, opening.read_as)
    qtbot.addWidget(bar)
    opening.unit_assumed.connect(bar.offer)

    opening.dropped([QUrl.fromLocalFile(str(file))])
    qtbot.waitUntil(lambda: not bar.isHidden())
    assert size_of(desk) == [200, 100, 300]
    assert "200 × 100 × 300 m" in bar.sentence.text()
    assert said
    assert "--" not in " ".join(said)  # a window has no options

    bar.buttons["Centimetres"].click()
    assert bar.isHidden()
    qtbot.waitUntil(lambda: not bar.isHidden())
    assert size_of(desk) == [2, 1, 3]
    assert len(desk.document.meshes) == 1
    assert not bar.buttons["Metres"].isHidden()
    assert bar.buttons["Centimetres"].isHidden()
    assert desk.session.history.names.count("Import mesh") == 1

    bar.turn_button.click()  # keeps the unit
    qtbot.waitUntil(lambda: not bar.isHidden())
    assert size_of(desk) == [2, 3, 1]

    opening.open(file)  # in place of a document that has a mesh already
    qtbot.waitUntil(lambda: size_of(desk) == [200, 100, 300])
    qtbot.waitUntil(lambda: not bar.isHidden())
    bar.buttons["Millimetres"].click()
    qtbot.waitUntil(lambda: not bar.isHidden())
    assert size_of(desk) == [0.2, 0.1, 0.3]
    assert desk.session.history.undo_name is None
    desk.session.edit("Other work", lambda document: small_document())
    assert bar.isHidden()
