"""Preferences reach the disk without the window waiting for it, the newest last."""

from __future__ import annotations

from pathlib import Path

from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.settings import Settings, load_settings
from app.window.settings_keeper import SettingsKeeper
from tools.session import Session


def test_the_newest_preferences_are_kept_and_written_on_another_thread(qtbot: QtBot, tmp_path: Path) -> None:
    desk = Desk(Session())
    keeper = SettingsKeeper(desk, tmp_path)
    for size in range(10, 21):
        keeper.keep(Settings(text_size=size))
    assert [job.name for job in desk.jobs.running] == ["Keep the preferences"], "one after another"
    qtbot.waitUntil(lambda: not desk.jobs.running)
    assert load_settings(tmp_path).settings.text_size == 20
    keeper.keep(Settings(text_size=11))
    desk.jobs.close()
    keeper.close()
    assert load_settings(tmp_path).settings.text_size == 11
    desk.session.close(discard=True)


def test_a_disk_that_refuses_is_said_and_tried_again_with_the_next_change(qtbot: QtBot, tmp_path: Path) -> None:
    folder = tmp_path / "settings"
    folder.write_text("")
    desk = Desk(Session())
    said: list[str] = []
    desk.failed.connect(lambda words, details: said.append(words))
    keeper = SettingsKeeper(desk, folder)
    keeper.keep(Settings(text_size=14))
    qtbot.waitUntil(lambda: bool(said))
    assert "cannot be made" in said[0]
    folder.unlink()
    keeper.keep(Settings(text_size=15))
    qtbot.waitUntil(lambda: not desk.jobs.running)
    assert load_settings(folder).settings.text_size == 15
    desk.jobs.close()
    desk.session.close(discard=True)
