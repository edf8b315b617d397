"""The dialog that chooses files: Return takes what was typed, and nothing in it shines brighter than the theme."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import QFileInfo, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileSystemModel, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from app.window.files.file_dialog import FileDialog, Icons
from app.window.files.opening import choose_file
from app.window.theme import apply, load_theme


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sub").mkdir()
    for name in ("coat one", "coat two"):
        (tmp_path / f"{name}.usdc").write_bytes(b"")
    return tmp_path


@pytest.fixture
def window(qtbot: QtBot) -> QWidget:
    window = QWidget()
    qtbot.addWidget(window)
    window.show()
    return window


def shown(qtbot: QtBot, window: QWidget, folder: Path, chosen: list[Path], save: str = ".usdc") -> FileDialog:
    dialog = choose_file(window, "Export coat", ["Coats (*.usdc)"], chosen.append, save, start=folder)
    assert isinstance(dialog, FileDialog)
    qtbot.waitUntil(dialog.isVisible, timeout=5000)
    return dialog


def typed(qtbot: QtBot, dialog: FileDialog, text: str) -> QWidget:
    """Type a name until names that begin so are offered; the list of them."""
    [line] = dialog.findChildren(QLineEdit, "fileNameEdit")
    line.setFocus()
    line.clear()
    [model] = dialog.findChildren(QFileSystemModel)
    qtbot.waitUntil(lambda: model.rowCount(model.index(model.rootPath())) == 3, timeout=5000)
    QTest.keyClicks(line, text)
    qtbot.waitUntil(lambda: QApplication.activePopupWidget() is not None, timeout=5000)
    popup = QApplication.activePopupWidget()
    assert popup is not None
    return popup


def test_return_saves_under_the_name_typed_although_others_are_offered(
    qtbot: QtBot, window: QWidget, folder: Path,
) -> None:
    chosen: list[Path] = []
    dialog = shown(qtbot, window, folder, chosen)
    QTest.keyClick(typed(qtbot, dialog, "coat"), Qt.Key.Key_Return)
    assert chosen == [folder / "coat.usdc"]
    assert QApplication.activePopupWidget() is None


def test_return_on_an_offered_name_opens_it(qtbot: QtBot, window: QWidget, folder: Path) -> None:
    chosen: list[Path] = []
    dialog = shown(qtbot, window, folder, chosen, save="")
    popup = typed(qtbot, dialog, "coat")
    QTest.keyClick(popup, Qt.Key.Key_Down)
    QTest.keyClick(popup, Qt.Key.Key_Return)
    assert [path.name for path in chosen] in (["coat one.usdc"], ["coat two.usdc"])


@pytest.mark.parametrize("name", ["dark", "light"])
def test_it_keeps_to_the_lights_and_colours_of_the_theme(
    qtbot: QtBot, window: QWidget, folder: Path, name: str,
) -> None:
    app, theme = QApplication.instance(), load_theme(name)
    assert isinstance(app, QApplication)
    try:
        apply(app, theme, 12)
        dialog = shown(qtbot, window, folder, [])
        [line] = dialog.findChildren(QLineEdit, "fileNameEdit")
        line.clearFocus()
        qtbot.wait(1)
        image = dialog.grab().toImage()
        colours = [image.pixelColor(x, y) for x in range(0, image.width(), 2) for y in range(0, image.height(), 2)]
        limits = [QColor(getattr(theme, part)).lightness() for part in ("field", "panel", "text", "ground", "line")]
        assert min(limits) - 8 <= min(c.lightness() for c in colours)
        assert max(c.lightness() for c in colours) <= max(limits) + 8
        accent = QColor(theme.accent).hslHue()
        loud = [c for c in colours if c.hslSaturation() > 90 and 40 < c.lightness() < 215]
        assert all(min(abs(c.hslHue() - accent), 360 - abs(c.hslHue() - accent)) < 40 for c in loud), "no foreign icon"
        dialog.reject()
    finally:
        apply(app, load_theme("dark"), 12)


def test_a_folder_of_many_files_costs_two_icons(qtbot: QtBot, folder: Path) -> None:
    icons = Icons()
    files, folders = [QFileInfo(str(path)) for path in folder.glob("*.usdc")], QFileInfo(str(folder / "sub"))
    assert {icons.icon(file).cacheKey() for file in files} == {icons.icon(files[0]).cacheKey()}
    assert icons.icon(folders).cacheKey() == icons.icon(Icons.IconType.Drive).cacheKey()
    assert icons.icon(folders).cacheKey() != icons.icon(files[0]).cacheKey()
