"""Recent files: listed, marked when they are gone, chosen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.files.recent import SHORTEST_FOLDER, RecentMenu, look_up, short_folder
from app.window.settings import MOST_RECENT, Settings, load_settings, save_settings
from tools.session import Session


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session())
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


def test_files_are_remembered_newest_first_across_starts(tmp_path: Path) -> None:
    settings = Settings()
    for number in range(MOST_RECENT + 3):
        settings = settings.opened(tmp_path / f"Katze {number} 猫.filo")
    settings = settings.opened(tmp_path / "Katze 5 猫.filo")
    save_settings(settings, tmp_path)
    found = load_settings(tmp_path).settings.recent
    assert len(found) == MOST_RECENT
    assert found[0] == str(tmp_path / "Katze 5 猫.filo")
    assert len(set(found)) == MOST_RECENT


def test_missing_files_are_marked(tmp_path: Path) -> None:
    (tmp_path / "there.filo").write_bytes(b"x")
    (tmp_path / "folder.filo").mkdir()
    found = look_up([str(tmp_path / name) for name in ("there.filo", "gone.obj", "folder.filo", "a\0b")])
    assert [file.there for file in found] == [True, False, False, False]
    assert [file.icon for file in found] == ["groom", "mesh", "groom", "groom"]


def test_the_menu_marks_and_chooses(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    good, gone = tmp_path / "good & best.filo", tmp_path / "gone.filo"
    good.write_bytes(b"x")
    chosen: list[Path] = []
    menu = RecentMenu(desk, [str(good), str(gone)], chosen.append)
    qtbot.addWidget(menu)
    qtbot.waitUntil(lambda: not desk.jobs.running)
    first, second = menu.actions()
    assert first.isEnabled()
    assert first.text().startswith("good && best.filo")
    assert not second.isEnabled()
    assert "missing" in second.text()
    menu.popup(menu.mapToGlobal(menu.rect().center()))
    qtbot.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(first).center())
    assert chosen == [good]


def test_without_recent_files_the_menu_says_so(desk: Desk, qtbot: QtBot) -> None:
    menu = RecentMenu(desk, [], lambda path: None)
    qtbot.addWidget(menu)
    [only] = menu.actions()
    assert not only.isEnabled()
    assert only.text() == "No file was opened yet"


def test_a_long_folder_loses_its_middle() -> None:
    assert short_folder(Path.home() / "cats" / "a.filo") == "~/cats"
    assert short_folder(Path("/shots/a.filo")) == "/shots"
    long = short_folder(Path("/shots") / ("x" * 100) / "last" / "a.filo")
    assert len(long) == SHORTEST_FOLDER
    assert long.endswith("/last")
