"""Doors, opening and dropping: what comes in, and that what cannot be read changes nothing."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.files import opening as opening_module
from app.window.files.doors import Doors
from app.window.files.opening import Opening, choose_file, filter_of
from core.formats.mesh_file import write_mesh
from core.formats.project import write_project
from core.workspace import Workspace
from tests.documents import grid_mesh, small_document
from tools.session import Session


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session())
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


@pytest.fixture
def opening(desk: Desk) -> Opening:
    return Opening(desk, remember=remembered.append)


@pytest.fixture(autouse=True)
def forget() -> None:
    remembered.clear()


remembered: list[Path] = []


def idle(desk: Desk, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: not desk.jobs.running, timeout=60_000)


def errors_of(desk: Desk) -> list[str]:
    found: list[str] = []
    desk.failed.connect(lambda sentence, details: found.append(sentence))
    return found


@pytest.mark.parametrize("name", ["plain.obj", "Katze 猫 ñ.OBJ", "a b'c\"d.ply"])
def test_a_mesh_comes_into_the_empty_document_as_a_step(
    desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot, name: str
) -> None:
    path = tmp_path / name
    write_mesh(path, grid_mesh(3))
    with qtbot.waitSignal(opening.opened, timeout=30_000):
        opening.open(path)
    idle(desk, qtbot)
    assert [m.name for m in desk.document.meshes] == [path.stem]
    assert len(desk.document.meshes[0].mesh.counts) == 9
    assert desk.groom is not None
    assert len(desk.groom.guides) == 0
    assert desk.session.history.undo_name == "Import mesh"
    assert remembered == [path]
    desk.session.undo()
    assert desk.document.meshes == ()


def test_opening_a_mesh_over_work_begins_a_new_document_and_importing_adds(
    desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot
) -> None:
    path = tmp_path / "tail.obj"
    write_mesh(path, grid_mesh(2))
    desk.replace_session(Session(small_document()))
    opening.import_mesh(path)
    idle(desk, qtbot)
    assert [m.name for m in desk.document.meshes] == ["sheet", "tail"]
    assert desk.groom is not None
    assert desk.groom.mesh_id == desk.document.meshes[1].id
    opening.open(path)
    idle(desk, qtbot)
    assert [m.name for m in desk.document.meshes] == ["tail"]
    assert desk.session.history.undo_name is None


def test_a_project_is_opened_with_its_workspace(desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot) -> None:
    path = tmp_path / "käfer.filo"
    write_project(path, small_document(), Workspace(frame=1033.0))
    opening.open(path)
    idle(desk, qtbot)
    assert desk.session.path == path
    assert desk.session.saved
    assert desk.workspace.frame == 1033.0
    assert np.array_equal(desk.document.grooms[0].guides.points, small_document().grooms[0].guides.points)
    assert remembered == [path]


@pytest.mark.parametrize("name", ["broken.filo", "broken.obj", "broken.usdc", "missing.filo", "missing.obj",
                                  "scene.fbx", "letter.doc", "noname"])
def test_what_cannot_be_opened_is_said_and_changes_nothing(
    desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot, name: str
) -> None:
    path = tmp_path / name
    if not name.startswith("missing"):
        path.write_bytes(b"nothing of the kind")
    desk.replace_session(Session(small_document()))
    session, document = desk.session, desk.document
    failed = errors_of(desk)
    opening.open(path)
    idle(desk, qtbot)
    assert len(failed) == 1
    assert name in failed[0]
    assert desk.session is session
    assert desk.document is document
    assert remembered == []


def test_opening_can_be_cancelled(
    desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    go = threading.Event()

    def slow(path: Path, cancel: Any) -> Any:
        go.wait(20.0)
        return read(path, cancel=cancel)

    read = opening_module.read_mesh
    monkeypatch.setattr(opening_module, "read_mesh", slow)
    path = tmp_path / "cat.obj"
    write_mesh(path, grid_mesh(1))
    opening.open(path)
    [job] = desk.jobs.running
    assert job.name == "Read cat.obj"
    desk.jobs.cancel(job)
    go.set()
    idle(desk, qtbot)
    assert desk.document.meshes == ()
    assert remembered == []


def urls(*paths: Path) -> list[QUrl]:
    return [QUrl.fromLocalFile(str(path)) for path in paths]


def test_meshes_and_pictures_are_dropped_together(desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot) -> None:
    meshes = [tmp_path / "a.obj", tmp_path / "b ü.ply"]
    for path in meshes:
        write_mesh(path, grid_mesh(1))
    opening.dropped(urls(*meshes, tmp_path / "photo.JPG", tmp_path / "plate.png"))
    idle(desk, qtbot)
    assert sorted(m.name for m in desk.document.meshes) == ["a", "b ü"]
    pinned = desk.workspace.view.references
    assert [r.path for r in pinned] == [str(tmp_path / "photo.JPG"), str(tmp_path / "plate.png")]
    assert len({r.x for r in pinned}) == 2


def test_a_dropped_project_is_opened_alone_and_strangers_are_named(
    desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot
) -> None:
    project, mesh = tmp_path / "a.filo", tmp_path / "a.obj"
    write_project(project, small_document())
    write_mesh(mesh, grid_mesh(1))
    opening.dropped(urls(mesh, project))
    idle(desk, qtbot)
    assert [m.name for m in desk.document.meshes] == ["sheet"]
    failed = errors_of(desk)
    opening.dropped(urls(tmp_path / "song.mp3"))
    opening.dropped([QUrl("https://example.org/cat.obj")])
    assert [sentence.split(" is nothing")[0] for sentence in failed] == ["song.mp3", "What was dropped"]


def test_a_dropped_folder_is_a_plate(desk: Desk, tmp_path: Path) -> None:
    plates: list[Path] = []
    failed = errors_of(desk)
    Opening(desk, open_plate=plates.append).dropped(urls(tmp_path))
    assert plates == [tmp_path]
    assert failed == []


def test_the_doors_open_and_close_with_the_document(desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot) -> None:
    good, gone = tmp_path / "good.obj", tmp_path / "gone.obj"
    write_mesh(good, grid_mesh(1))
    doors = Doors(desk, opening, lambda: (str(good), str(gone)))
    qtbot.addWidget(doors)
    doors.resize(1000, 600)
    needed: list[bool] = []
    doors.needed.connect(needed.append)
    with qtbot.waitExposed(doors):
        doors.show()
    qtbot.waitUntil(lambda: len(doors.files.rows) == 2)
    assert [row.isEnabled() for row in doors.files.rows] == [True, False]
    qtbot.mouseClick(doors.files.rows[1], Qt.MouseButton.LeftButton)
    assert not desk.jobs.running
    qtbot.mouseClick(doors.files.rows[0], Qt.MouseButton.LeftButton)
    idle(desk, qtbot)
    assert needed == [False]
    desk.session.undo()
    assert needed == [False, True]


def test_the_door_to_the_demo(desk: Desk, opening: Opening, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opening_module, "DEMO_HAIRS", 100)
    monkeypatch.setattr(opening_module, "DEMO_GUIDES", 50)
    doors = Doors(desk, opening)
    qtbot.addWidget(doors)
    doors.show()
    qtbot.mouseClick(doors.demo, Qt.MouseButton.LeftButton)
    idle(desk, qtbot)
    assert desk.groom is not None
    assert len(desk.groom.guides) == 50
    assert desk.workspace.frame == desk.document.first_frame
    assert desk.session.evaluator.bytes > 0  # what was calculated for it is kept


def test_a_door_asks_for_a_file_with_a_dialog_of_our_own(
    desk: Desk, tmp_path: Path, qtbot: QtBot
) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.show()
    opening = Opening(desk, window, remember=remembered.append)
    doors = Doors(desk, opening, parent=window)
    path = tmp_path / "my cat.obj"
    write_mesh(path, grid_mesh(1))
    qtbot.mouseClick(doors.mesh, Qt.MouseButton.LeftButton)
    [dialog] = window.findChildren(QFileDialog)
    assert dialog.testOption(QFileDialog.Option.DontUseNativeDialog)
    assert "*.usdz" in dialog.nameFilters()[0]
    assert "*.filo " in dialog.nameFilters()[0]
    [field] = dialog.findChildren(QLineEdit, "fileNameEdit")
    field.setText(str(path))
    dialog.accept()
    idle(desk, qtbot)
    assert [m.name for m in desk.document.meshes] == ["my cat"]


def test_a_file_dropped_on_the_doors_comes_in(desk: Desk, opening: Opening, tmp_path: Path, qtbot: QtBot) -> None:
    doors = Doors(desk, opening)
    qtbot.addWidget(doors)
    doors.show()
    path = tmp_path / "cat.obj"
    write_mesh(path, grid_mesh(1))
    data = QMimeData()
    data.setUrls(urls(path))
    place, copy, left = QPointF(50, 50), Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton
    enter = QDragEnterEvent(place.toPoint(), copy, data, left, Qt.KeyboardModifier.NoModifier)
    QApplication.sendEvent(doors, enter)
    assert enter.isAccepted()
    words = QMimeData()
    words.setText("cat")
    other = QDragEnterEvent(place.toPoint(), copy, words, left, Qt.KeyboardModifier.NoModifier)
    other.ignore()
    QApplication.sendEvent(doors, other)
    assert not other.isAccepted()
    QApplication.sendEvent(doors, QDropEvent(place, copy, data, left, Qt.KeyboardModifier.NoModifier))
    idle(desk, qtbot)
    assert [m.name for m in desk.document.meshes] == ["cat"]


def test_a_name_to_save_under_gets_its_suffix(tmp_path: Path, qtbot: QtBot) -> None:
    chosen: list[Path] = []
    window = QWidget()
    qtbot.addWidget(window)
    dialog = choose_file(window, "Save as", [filter_of("Projects", (".filo",))], chosen.append, save=".filo",
                         start=tmp_path)
    [field] = dialog.findChildren(QLineEdit, "fileNameEdit")
    field.setText("katze")
    dialog.accept()
    assert chosen == [tmp_path / "katze.filo"]
