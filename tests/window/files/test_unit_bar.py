"""A mesh whose file does not say its unit can be read in another one from the window, in place of itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QUrl
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.files.opening import Assumed, Opening
from app.window.files.unit_bar import UnitBar
from core.formats.mesh_file import read_mesh, write_mesh
from tests.documents import small_document
from tools.document_edits import first_reach
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
    opening.assumed.connect(bar.offer)

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
    assert desk.session.history.undo_name == "Read in another unit"
    reach = desk.document.grooms[-1].coat.reach
    assert reach == first_reach(desk.document.meshes[-1].mesh)
    assert reach < 1

    bar.turn_button.click()  # keeps the unit
    qtbot.waitUntil(lambda: not bar.isHidden())
    assert size_of(desk) == [2, 3, 1]

    opening.open(file)  # in place of a document that has a mesh already
    qtbot.waitUntil(lambda: size_of(desk) == [200, 100, 300])
    qtbot.waitUntil(lambda: not bar.isHidden())
    bar.buttons["Millimetres"].click()
    qtbot.waitUntil(lambda: not bar.isHidden())
    assert size_of(desk) == [0.2, 0.1, 0.3]
    desk.session.undo()
    assert size_of(desk) == [200, 100, 300]
    desk.session.edit("Other work", lambda document: small_document())
    assert bar.isHidden()


def test_several_at_once(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    """One answer is for all that came in together; what a file says of itself is not asked."""
    files = [tmp_path / name for name in ("leg.obj", "body.obj", "says.glb")]
    for file in files[:2]:
        file.write_text(BOX)
    mesh = read_mesh(files[0], unit="cm").mesh
    write_mesh(files[2], mesh)
    opening = Opening(desk)
    bar = UnitBar(desk, opening.read_as)
    qtbot.addWidget(bar)
    opening.assumed.connect(bar.offer)
    opening.dropped([QUrl.fromLocalFile(str(file)) for file in files])
    qtbot.waitUntil(lambda: len(desk.document.meshes) == 3 and not desk.jobs.running)
    assert "1 more do not say their unit" in bar.sentence.text()
    bar.buttons["Centimetres"].click()
    qtbot.waitUntil(lambda: not bar.isHidden())
    for item in desk.document.meshes:
        assert np.ptp(item.mesh.points, axis=0) == pytest.approx([2, 1, 3], rel=1e-6)
    assert "--" not in bar.sentence.text()
    desk.session.undo()
    widths = sorted(float(np.ptp(item.mesh.points[:, 0])) for item in desk.document.meshes)
    assert widths == pytest.approx([2, 200, 200])


def test_up_axis_alone(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    """A file that says its unit is asked for no other, and one that says its up axis is not turned."""
    found = read_mesh(_written(tmp_path), unit="m", up="y")
    bar = UnitBar(desk, lambda these, **how: None)
    qtbot.addWidget(bar)
    bar.offer(Assumed(1, tmp_path / "a.abc", found._replace(unit_source="file", up_source="assumed")))
    assert "which axis is up: read Y up" in bar.sentence.text()
    assert [button.isHidden() for button in bar.buttons.values()] == [True] * 5 + [False]
    desk.session_replaced.emit()
    bar.offer(Assumed(1, tmp_path / "a.usda", found._replace(unit_source="assumed", up_source="file")))
    assert bar.turn_button.isHidden()
    assert not bar.buttons["Inches"].isHidden()


def _written(folder: Path) -> Path:
    path = folder / "box.obj"
    path.write_text(BOX)
    return path
