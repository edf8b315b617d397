"""The main window: what commands ask of it, what it shows of a document, what it keeps."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu

from app.window.commands import Window
from app.window.settings import load_settings
from app.window.theme import look_of
from app.window.window_commands import AT_FIRST_HIDDEN, PANEL_CRAFTS, PANELS
from core.document import Document
from core.formats.journal import state_folder
from core.formats.project import read_project
from core.formats.recovery import abandoned, recover
from tests.window.conftest import Opened
from tests.window.hand import CTRL, Hand

BACK, ASIDE = (0.60, 0.42), (0.68, 0.36)


def test_it_has_everything_commands_ask_for(opened: Opened) -> None:
    window = opened().window
    asked = [name for name in vars(Window) if not name.startswith("_")] + list(Window.__annotations__)
    assert [name for name in asked if not hasattr(window, name)] == []


def test_an_empty_document_shows_doors_and_a_mesh_the_view(opened: Opened, animal: Document) -> None:
    window = opened().window
    assert window.doors.isVisible()
    window.desk.edit("Import mesh", lambda d: d.replace(meshes=animal.meshes))
    assert not window.doors.isVisible()
    assert window.view.isVisible()
    window.commands.run("edit.undo")
    assert window.doors.isVisible()


def test_the_title_and_the_top_say_whether_work_is_saved(hand: Hand, tmp_path: Path) -> None:
    window = hand.window
    assert not window.isWindowModified()
    hand.drag(BACK, ASIDE)
    assert window.isWindowModified()
    written = window.desk.session.autosaved
    hand.until(lambda: window.desk.session.autosaved is not None)
    assert written is None or written <= window.desk.session.autosaved
    for past, words in ((2.0, "autosaved"), (43.0, "autosaved 40 s ago"), (250.0, "autosaved 4 min ago")):
        window.top.clock = lambda past=past: window.desk.session.autosaved + past
        window.top.refresh()
        assert window.top.file.text().endswith(f"•  {words}")
    window.files.save_as(tmp_path / "mine.filo")
    assert not window.isWindowModified()
    assert "mine.filo" in window.windowTitle()
    assert "mine.filo" in window.top.file.text()
    assert "saved" in window.top.file.text()
    saved, _ = read_project(tmp_path / "mine.filo")
    assert (saved.grooms[0].guides.points == window.desk.document.grooms[0].guides.points).all()
    hand.until(lambda: load_settings().settings.recent == (str(tmp_path / "mine.filo"),))


def test_the_console_leaves_the_view_its_room_and_takes_the_keys_while_it_is_there(hand: Hand) -> None:
    window = hand.window
    window.show_console()
    hand.until(lambda: 0 < window._console.height() <= 0.27 * window.height())
    hand.rest()
    assert window._console.height() <= 0.27 * window.height()
    typed_in = window._console.widget().input
    hand.until(lambda: window._console.isVisible() and typed_in.hasFocus())
    window.show_console()
    hand.until(lambda: not window._console.isVisible() and window.viewport.isActive() and not typed_in.hasFocus())


def test_larger_letters_get_a_wider_column(hand: Hand) -> None:
    window = hand.window
    window.resize(1600, 800)
    hand.until(lambda: window.width() == 1600)
    before = window.column.width()
    window.crash.tell("Words beside an icon.")
    try:
        window.change_settings(text_size=20)
        hand.until(lambda: window.column.width() >= window.column.widget().minimumSizeHint().width())
        look = look_of()
        beside = look.gap + look.grid + look.icon  # the icon
        hand.until(lambda: window.crash.sentence.x() >= beside)
    finally:
        window.change_settings(text_size=12)
    hand.until(lambda: abs(window.column.width() - before) <= 4)


def test_closing_keeps_unsaved_work_for_the_next_start(opened: Opened, animal: Document) -> None:
    hand = opened(animal)
    hand.drag(BACK, ASIDE)
    document = hand.window.desk.document
    hand.window.close()
    states = [recover(state_folder(), token) for token in abandoned(state_folder())]
    assert any(
        state is not None and (state.document.grooms[0].guides.points == document.grooms[0].guides.points).all()
        for state in states)


@pytest.mark.parametrize("name", list(PANELS))
def test_panels_are_shown_and_hidden(name: str, opened: Opened, animal: Document) -> None:
    window = opened(animal).window
    window.desk.set_craft(PANEL_CRAFTS.get(name, ("groom",))[0])
    panel = window.panels[name]
    at_first = name not in AT_FIRST_HIDDEN
    assert panel.isVisible() is at_first
    window.commands.run(f"window.{name}")
    assert panel.isVisible() is not at_first
    window.commands.run("window.reset_layout")
    assert panel.isVisible() is at_first


def test_theme_text_and_keymap_change_at_once_and_are_kept(opened: Opened) -> None:
    hand = opened()
    window = hand.window
    try:
        window.commands.run("window.theme")
        window.commands.run("window.text_larger")
        window.change_settings(keymap="maya")
        hand.until(lambda: not window.desk.jobs.running)
        assert look_of().theme.name.lower() == "light"
        assert look_of().text == 13
        assert window.hotkeys.keymap.name == "Maya"
        kept = load_settings().settings
        assert (kept.theme, kept.text_size, kept.keymap) == ("light", 13, "maya")
    finally:
        window.change_settings(theme="dark", text_size=12)


def test_the_status_line_says_what_the_hand_does_now(hand: Hand) -> None:
    status, commands = hand.window.status, hand.window.commands
    assert hand.window.desk.session.tool.hint in status.words.text()
    commands.run("tool.cut")
    assert hand.window.desk.session.tool.hint in status.words.text()
    hand.window.desk.said.emit("Something new.")
    assert status.words.text() == "Something new."


def test_the_palette_opens_by_its_key_over_the_view(hand: Hand) -> None:
    hand.key(Qt.Key.Key_K, CTRL)
    from app.window.palette import Palette

    palettes = hand.window.findChildren(Palette)
    assert [p for p in palettes if p.isVisible()]
    for palette in palettes:
        palette.close()


def commands_in(menu: QMenu) -> int:
    count = 0
    for action in menu.actions():
        below = action.menu()
        count += commands_in(below) if isinstance(below, QMenu) else not action.isSeparator()
    return count


def test_every_command_is_in_the_menu(opened: Opened) -> None:
    window = opened().window
    menu = window.top.menu()
    assert commands_in(menu) == len(window.commands)
    menu.deleteLater()


def test_playing_moves_the_frame_and_the_picture(hand: Hand) -> None:
    desk, frames = hand.window.desk, hand.view.frames
    desk.set_workspace(frame=float(desk.document.first_frame))
    hand.window.commands.run("frame.play")
    assert hand.window.playing
    hand.until(lambda: desk.workspace.frame >= desk.document.first_frame + 3)
    hand.until(lambda: hand.view.frames > frames + 2)
    hand.window.commands.run("frame.play")
    assert not hand.window.playing
    hand.rest()


def test_a_playblast_draws_finished_frames_and_gives_the_view_back(hand: Hand) -> None:
    first = hand.window.desk.document.first_frame
    pictures = []
    for frame in (first, first + 12):
        *_, pixels = hand.view.draw_frame(float(frame), (200, 120))
        pictures.append(pixels)
    assert pictures[0].shape == (120, 200, 3)
    assert pictures[0].std() > 10.0
    assert (pictures[0] != pictures[1]).any()
    hand.rest()
    assert hand.window.desk.workspace.frame != first + 12
    hand.drag(BACK, ASIDE)
    assert hand.window.desk.session.history.undo_name == "Comb"
