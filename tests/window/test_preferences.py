"""Preferences: kept as a whole, broken files put aside, every change works at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit, QTabWidget
from pytestqt.qtbot import QtBot

from app.window.fields.choice_bar import ChoiceBar, SwitchBar
from app.window.fields.number_bar import NumberBar
from app.window.preferences import Preferences, PressureCurve
from app.window.settings import Settings, load_settings, save_settings
from core.errors import UserError
from core.field import fields_of
from tools.pen import PenSettings


def test_settings_come_back_as_they_were_saved(tmp_path: Path) -> None:
    settings = Settings(
        theme="light", text_size=15, keymap="maya", unit="cm", history_mb=256, density_ms=40.0,
        pen=PenSettings(curve=((0.0, 0.1), (0.5, 0.4), (1.0, 1.0)), spikes=False, smoothing=0.5),
        plugin_folder="/studio", recent=("/a/b.filo",), geometry="AAAA")
    save_settings(settings, tmp_path / "deep" / "down")
    again, trouble = load_settings(tmp_path / "deep" / "down")
    assert trouble is None
    assert [getattr(again, n) for n in Settings.__struct_fields__ if n != "pen"] == [
        getattr(settings, n) for n in Settings.__struct_fields__ if n != "pen"]
    assert again.pen.curve == settings.pen.curve
    assert not again.pen.spikes


@pytest.mark.parametrize("content", [
    b"", b"{", b"\x00\x01", b'{"theme": "pink"}', b'{"text_size": 500}', b'{"text_size": "12"}', b'{"run": "code"}',
    b'{"pen": {"curve": [[0, 0]]}}', b"[" * 100_000, b" " * (2 << 20), b'{"density_ms": 1e999}'])
def test_a_broken_file_is_put_aside_and_said(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "settings.json").write_bytes(content)
    settings, trouble = load_settings(tmp_path)
    assert settings.theme == "dark"
    assert trouble is not None
    assert "settings.json" in trouble
    assert (tmp_path / "settings.json.broken").read_bytes() == content
    assert load_settings(tmp_path).trouble is None


def test_what_cannot_be_read_or_written_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "settings.json").mkdir()
    settings, trouble = load_settings(tmp_path)
    assert settings.theme == "dark"
    assert trouble is not None
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be made"):
        save_settings(Settings(), tmp_path / "file" / "folder")


def test_recent_files_are_few_and_newest_first(tmp_path: Path) -> None:
    settings = Settings()
    for i in range(20):
        settings = settings.opened(tmp_path / f"{i}.filo")
    settings = settings.opened(tmp_path / "15.filo")
    assert [Path(r).stem for r in settings.recent] == ["15", "19", "18", "17", "16", "14", *map(str, range(13, 7, -1))]


def test_every_preference_says_enough() -> None:
    for known in (*fields_of(Settings).values(), *fields_of(PenSettings).values()):
        assert len(known.tooltip.split()) >= 8, known.label


class Owner:
    """Keeps settings as the main window does."""

    def __init__(self) -> None:
        self.settings = Settings(recent=("/a.filo",))
        self.editors = 0

    def change_settings(self, **changes: Any) -> None:
        self.settings = self.settings.replace(**changes)

    def show_keymap_editor(self) -> None:
        self.editors += 1


@pytest.fixture
def owner() -> Owner:
    return Owner()


@pytest.fixture
def dialog(owner: Owner, qtbot: QtBot) -> Preferences:
    dialog = Preferences(None, owner)
    with qtbot.waitExposed(dialog):
        dialog.show()
    return dialog


def test_a_choice_works_at_once(dialog: Preferences, owner: Owner, qtbot: QtBot) -> None:
    assert not dialog.isModal()
    theme = dialog.findChild(ChoiceBar, "theme")
    theme.setFocus()
    qtbot.keyClick(theme, Qt.Key.Key_Right)
    assert owner.settings.theme == "light"


def test_a_number_counts_when_it_is_whole(dialog: Preferences, owner: Owner, qtbot: QtBot) -> None:
    size = dialog.findChild(NumberBar, "text_size")
    size.setFocus()
    qtbot.keyClick(size, Qt.Key.Key_Return)
    assert size.line is not None
    qtbot.keyClicks(size.line, "16")
    assert owner.settings.text_size == 12
    qtbot.keyClick(size.line, Qt.Key.Key_Return)
    assert owner.settings.text_size == 16
    assert dialog.isVisible()


def test_the_pen_is_set_up(dialog: Preferences, owner: Owner, qtbot: QtBot) -> None:
    dialog.findChild(QTabWidget).setCurrentIndex(1)
    qtbot.mouseClick(dialog.findChild(SwitchBar, "spikes"), Qt.MouseButton.LeftButton)
    assert not owner.settings.pen.spikes
    smoothing = dialog.findChild(NumberBar, "smoothing")
    smoothing.setFocus()
    qtbot.keyClick(smoothing, Qt.Key.Key_Return)
    qtbot.keyClicks(smoothing.line, "1/4")
    qtbot.keyClick(smoothing.line, Qt.Key.Key_Return)
    assert owner.settings.pen.smoothing == pytest.approx(0.25)
    assert not owner.settings.pen.spikes


def test_the_pressure_curve_is_drawn(dialog: Preferences, owner: Owner, qtbot: QtBot) -> None:
    dialog.findChild(QTabWidget).setCurrentIndex(1)
    curve = dialog.findChild(PressureCurve)
    start, end = curve.place_of((1.0, 1.0)).toPoint(), curve.place_of((1.0, 0.5)).toPoint()
    qtbot.mousePress(curve, Qt.MouseButton.LeftButton, pos=start)
    qtbot.mouseMove(curve, end)
    assert owner.settings.pen.curve == ((0.0, 0.0), (1.0, 1.0))
    qtbot.mouseRelease(curve, Qt.MouseButton.LeftButton, pos=end)
    assert owner.settings.pen.curve[0] == (0.0, 0.0)
    assert owner.settings.pen.curve[1] == pytest.approx((1.0, 0.5), abs=0.02)
    qtbot.mouseDClick(curve, Qt.MouseButton.LeftButton, pos=curve.place_of((0.5, 0.75)).toPoint())
    assert len(owner.settings.pen.curve) == 3
    qtbot.mouseDClick(curve, Qt.MouseButton.LeftButton, pos=curve.place_of(owner.settings.pen.curve[1]).toPoint())
    assert len(owner.settings.pen.curve) == 2


def test_what_changes_elsewhere_is_shown(dialog: Preferences, owner: Owner) -> None:
    owner.change_settings(text_size=18, pen=PenSettings(curve=((0.0, 0.5), (1.0, 1.0))))
    dialog.refresh()
    assert dialog.findChild(NumberBar, "text_size").value() == 18
    assert dialog.findChild(PressureCurve).points[0] == (0.0, 0.5)


def test_files_and_reset(dialog: Preferences, owner: Owner, qtbot: QtBot) -> None:
    tabs = dialog.findChild(QTabWidget)
    tabs.setCurrentIndex(3)
    line = dialog.findChild(QLineEdit, "plugin_folder")
    qtbot.keyClicks(line, "/studio/tools")
    qtbot.keyClick(line, Qt.Key.Key_Return)
    assert owner.settings.plugin_folder == "/studio/tools"
    owner.change_settings(theme="light", text_size=18)
    dialog.reset.click()
    assert owner.settings.theme == "dark"
    assert owner.settings.text_size == 12
    assert owner.settings.recent == ("/a.filo",)
    dialog.clear_recent.click()
    assert owner.settings.recent == ()
    assert not dialog.clear_recent.isEnabled()
