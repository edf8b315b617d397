"""An updated mesh takes the place of the old one from the outliner; its hair comes along, and guesses are said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtWidgets import QFileDialog, QMenu

from core.formats.mesh_file import write_mesh
from core.formats.project import read_project
from core.mesh.mesh import Mesh
from core.mesh.surface import root_positions
from core.record import freeze
from tests.documents import grid_mesh, small_document
from tests.window.conftest import Opened
from tests.window.hand import Hand


def asked(hand: Hand, path: Path) -> QFileDialog:
    """Reload from the outliner's menu, with a file chosen in the dialog it opens."""
    outliner = hand.window.outliner
    menu: QMenu = outliner.menu(outliner.scene.index_of(hand.window.desk.document.meshes[0]))
    next(action for action in menu.actions() if action.text() == "Reload…").trigger()
    menu.deleteLater()
    dialog = next(d for d in hand.window.findChildren(QFileDialog) if d.isVisible())
    dialog.fileSelected.emit(str(path))
    dialog.close()
    hand.until(lambda: not hand.window.desk.jobs.running)
    return dialog


def test_a_larger_mesh_takes_its_hair_along(opened: Opened, tmp_path: Path) -> None:
    hand = opened(small_document())
    desk, before = hand.window.desk, hand.window.desk.document
    mesh: Mesh = before.meshes[0].mesh
    write_mesh(tmp_path / "larger.obj", mesh.replace(points=freeze(mesh.points * 2.0)))
    asked(hand, tmp_path / "larger.obj")
    after = desk.document
    guides, old = after.grooms[0].guides, before.grooms[0].guides
    assert len(guides) == len(old)
    assert np.allclose(after.meshes[0].mesh.points, 2.0 * mesh.points)
    assert np.allclose(guides.points[:, 0], root_positions(after.meshes[0].mesh, guides.roots), atol=1e-5)
    assert np.allclose(guides.points[:, 0], 2.0 * old.points[:, 0], atol=1e-4)
    assert desk.session.history.undo_name == "Reload mesh"
    assert "with all its hair" in hand.window.status.words.text()
    hand.window.commands.run("edit.undo")
    assert desk.document is before


def test_guides_whose_skin_is_gone_are_said_and_selected(opened: Opened, tmp_path: Path) -> None:
    hand = opened(small_document())
    before = hand.window.desk.document
    sheet = grid_mesh(6)  # turned over: no skin near any root faces the same way
    turned = sheet.replace(points=freeze(sheet.points * np.float32((1, 1, -1)) + np.float32((0, 0, 1))), uvs=None)
    write_mesh(tmp_path / "turned.obj", turned)
    asked(hand, tmp_path / "turned.obj")
    document = hand.window.desk.document
    assert len(document.meshes[0].mesh.points) == 49
    assert document.grooms[0].guides.selected.all()
    words = hand.window.status.words.text()
    assert f"{len(before.grooms[0].guides)} guides is gone" in words
    assert "selected" in words
    assert "--" not in words, "a window has no options"


def test_a_mesh_knows_its_file_and_asks_only_when_that_is_gone(opened: Opened, tmp_path: Path) -> None:
    hand = opened()
    desk, path = hand.window.desk, tmp_path / "sheet.obj"
    sheet = grid_mesh(4)
    write_mesh(path, sheet)
    hand.window.opening.open(path)
    hand.until(lambda: not desk.jobs.running)
    desk.session.save(tmp_path / "kept.filo")
    assert read_project(tmp_path / "kept.filo").document.meshes[0].source == str(path)
    write_mesh(path, sheet.replace(points=freeze(sheet.points * 3.0)))
    hand.window.commands.run("file.reload_mesh")
    hand.until(lambda: not desk.jobs.running)
    np.testing.assert_allclose(desk.document.meshes[0].mesh.points, 3.0 * sheet.points)
    assert not [d for d in hand.window.findChildren(QFileDialog) if d.isVisible()]
    hand.window.files.reload_mesh(ask=True)
    dialog = next(d for d in hand.window.findChildren(QFileDialog) if d.isVisible())
    assert [Path(name).name for name in dialog.selectedFiles()] == ["sheet.obj"]
    dialog.close()
    path.rename(tmp_path / "moved.obj")
    hand.window.commands.run("file.reload_mesh")
    dialog = next(d for d in hand.window.findChildren(QFileDialog) if d.isVisible())
    assert "no longer there" in hand.window.status.words.text()
    dialog.fileSelected.emit(str(tmp_path / "moved.obj"))
    dialog.close()
    hand.until(lambda: not desk.jobs.running)
    assert desk.document.meshes[0].source == str(tmp_path / "moved.obj")
