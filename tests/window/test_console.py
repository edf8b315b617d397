"""Python in the window: it runs, completes, remembers; its edits are steps, its loops can be stopped."""

from __future__ import annotations

import gc
import sys
import time
import weakref
from typing import Any

import pytest
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtGui import QKeyEvent, QTextCursor
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from app.window.console import TROUBLE, Console, _common_start, _last_word
from app.window.theme import apply, load_theme, look_of
from tests.window.host import Host


@pytest.fixture
def console(host: Host, qtbot: QtBot) -> Console:
    console = Console(host.desk, host)
    console.resize(500, 300)
    console.show()
    return console


def typed(console: Console, qtbot: QtBot, *lines: str) -> str:
    """What the console says to lines typed one after the other, each ended with Return."""
    before = len(console.output.toPlainText())
    for line in lines:
        qtbot.keyClicks(console.input, line)
        qtbot.keyClick(console.input, Qt.Key.Key_Return)
    return console.output.toPlainText()[before:]


def colour_at_end(console: Console) -> str:
    cursor = QTextCursor(console.output.document())
    cursor.movePosition(QTextCursor.MoveOperation.End)
    cursor.movePosition(QTextCursor.MoveOperation.PreviousCharacter)
    cursor.movePosition(QTextCursor.MoveOperation.PreviousCharacter)
    shape = cursor.charFormat()
    return shape.foreground().color().name() if shape.hasProperty(TROUBLE) else ""


def test_an_expression_shows_its_value(console: Console, qtbot: QtBot) -> None:
    assert typed(console, qtbot, "6 * 7") == ">>> 6 * 7\n42\n"
    assert typed(console, qtbot, "print('hello')").endswith("hello\n")
    assert console.input.toPlainText() == ""


def test_the_document_is_at_hand(console: Console, host: Host, qtbot: QtBot) -> None:
    assert typed(console, qtbot, "document.meshes[0].id, session.document is document").endswith("(7, True)\n")
    assert "core" in typed(console, qtbot, "core.__name__, tools.__name__")


def test_an_assignment_to_document_is_a_step(console: Console, host: Host, qtbot: QtBot) -> None:
    before = host.desk.document
    typed(console, qtbot, "document = document.replace(unit='cm')")
    assert host.desk.document.unit == "cm"
    assert host.desk.session.history.undo_name == "Console"
    host.commands.run("edit.undo")
    assert host.desk.document is before
    assert typed(console, qtbot, "document.unit").endswith(f"{before.unit!r}\n")
    assert host.desk.session.history.redo_name == "Console"  # to look is no step


def test_no_document_is_kept_alive(console: Console, host: Host) -> None:
    console.run("document = document.replace(unit='cm')")
    console.run("session")
    assert not {"document", "session"} & set(console.names)
    document = weakref.ref(host.desk.document)
    host.commands.run("file.new")
    gc.collect()
    assert document() is None


def test_edits_of_the_session_are_steps_too(console: Console, host: Host, qtbot: QtBot) -> None:
    typed(console, qtbot, "session.edit('Half', lambda d: d.replace(fps=d.fps / 2))")
    assert host.desk.session.history.undo_name == "Half"
    assert host.desk.document.fps == 12.0
    assert len(host.desk.session.history.names) == 2


def test_a_block_goes_on_until_an_empty_line(console: Console, qtbot: QtBot) -> None:
    qtbot.keyClicks(console.input, "for i in range(3):")
    qtbot.keyClick(console.input, Qt.Key.Key_Return)
    assert console.input.toPlainText() == "for i in range(3):\n    "
    qtbot.keyClicks(console.input, "print(i * 11)")
    qtbot.keyClick(console.input, Qt.Key.Key_Return)
    said = typed(console, qtbot, "")
    assert said.endswith("0\n11\n22\n")


def test_several_statements_run_together(console: Console) -> None:
    assert console.run("a = 2\nb = 3\nprint(a + b)")
    assert console.output.toPlainText().endswith("5\n")


def test_errors_are_red_and_harm_nothing(console: Console, host: Host, qtbot: QtBot) -> None:
    before, out = host.desk.document, sys.stdout
    said = typed(console, qtbot, "1 / 0")
    assert "ZeroDivisionError" in said
    assert "console.py" not in said  # only what was typed
    assert colour_at_end(console) == look_of().theme.trouble_text
    assert "SyntaxError" in typed(console, qtbot, "1 +* 2")
    said = typed(console, qtbot, "session.save()")
    assert "give a name to save under" in said
    assert "Traceback" not in said
    typed(console, qtbot, "session.edit('Bad', lambda d: 1 / 0)")
    assert host.desk.document is before
    assert host.desk.session.history.undo_name is None
    assert sys.stdout is out
    typed(console, qtbot, "2 + 2")
    assert colour_at_end(console) == ""


def test_another_theme_recolours_what_was_said(console: Console) -> None:
    application = QApplication.instance()
    assert isinstance(application, QApplication)
    console.run("1 / 0")
    try:
        apply(application, load_theme("light"), 14)
        assert colour_at_end(console) == load_theme("light").trouble_text
        assert console.output.font().pixelSize() == 14
    finally:
        apply(application, load_theme("dark"))
    assert colour_at_end(console) == load_theme("dark").trouble_text


def test_up_and_down_go_through_what_was_typed(console: Console, qtbot: QtBot) -> None:
    typed(console, qtbot, "a = 1", "b = 2")
    for key, text in ((Qt.Key.Key_Up, "b = 2"), (Qt.Key.Key_Up, "a = 1"), (Qt.Key.Key_Up, "a = 1"),
                      (Qt.Key.Key_Down, "b = 2"), (Qt.Key.Key_Down, "")):
        qtbot.keyClick(console.input, key)
        assert console.input.toPlainText() == text


def test_tab_completes(console: Console, qtbot: QtBot) -> None:
    qtbot.keyClicks(console.input, "document.mesh")
    qtbot.keyClick(console.input, Qt.Key.Key_Tab)
    assert console.input.toPlainText() == "document.meshes"
    console.input.clear()
    qtbot.keyClicks(console.input, "document.f")
    qtbot.keyClick(console.input, Qt.Key.Key_Tab)
    assert console.output.toPlainText().strip().endswith("first_frame   fps")
    assert _last_word("print(a.b") == "a.b"
    assert _common_start(["abc", "abd"]) == "ab"
    assert _common_start(["ab", "abd"]) == "ab"
    assert _common_start([]) == ""


@pytest.mark.parametrize("loop", ["while True: pass\n", "import time\nwhile True: time.sleep(0.01)"])
def test_a_runaway_loop_is_stopped_by_esc(console: Console, host: Host, loop: str) -> None:
    before = host.desk.document
    press_escape(console)
    assert console.run(loop)
    assert console.output.toPlainText().endswith("Stopped.\n")
    assert host.desk.document is before
    assert console.run("1 + 1")
    assert console.output.toPlainText().endswith("2\n")


def test_other_keys_do_not_reach_the_window_meanwhile(console: Console, host: Host) -> None:
    for key in (Qt.Key.Key_A, Qt.Key.Key_Escape):
        QCoreApplication.postEvent(
            console.input, QKeyEvent(QKeyEvent.Type.KeyPress, key, Qt.KeyboardModifier.NoModifier, key.name[-1]))
    console.run("while True: pass\n")
    assert console.input.toPlainText() == ""


def press_escape(console: Console) -> None:
    """The key waits in the queue while a loop runs, as that of a person does."""
    QCoreApplication.postEvent(
        console.input, QKeyEvent(QKeyEvent.Type.KeyPress, Qt.Key.Key_Escape, Qt.KeyboardModifier.NoModifier))


def test_a_stopped_edit_leaves_the_document_as_it_was(console: Console, host: Host) -> None:
    before = host.desk.document
    press_escape(console)
    console.run("def forever(document):\n    while True: pass\n")
    console.run("session.edit('Forever', forever)")
    assert console.output.toPlainText().endswith("Stopped.\n")
    assert host.desk.document is before
    assert host.desk.session.history.undo_name is None


def test_the_program_itself_is_not_stopped_midway(console: Console) -> None:
    house: dict[str, Any] = {"__name__": "app.window.some_panel", "time": time, "done": []}
    exec(  # a function whose module is one of ours
        "def draw():\n    end = time.monotonic() + 0.7\n    while time.monotonic() < end: pass\n    done.append(1)",
        house)
    console.names["draw"] = house["draw"]
    press_escape(console)
    console.run("draw()\nprint('drawn')\nwhile True: pass\n")
    assert house["done"] == [1]
    assert console.output.toPlainText().endswith("drawn\nStopped.\n")
