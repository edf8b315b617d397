"""What nobody caught becomes a report on this machine, and what killed the program is mentioned at the next start."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from app.window.crash import LAST_COMMANDS, MOST_REPORTS, REPORT, CrashBar, CrashWatch, crash_folder

SECRET = "the secret name of a cat"


@pytest.fixture
def watch(tmp_path: Path, qtbot: QtBot) -> Iterator[CrashWatch]:
    watch = CrashWatch(tmp_path / "crashes")
    before = sys.excepthook, threading.excepthook
    watch.install()
    yield watch
    watch.close()
    assert (sys.excepthook, threading.excepthook) == before


def reports(watch: CrashWatch) -> list[str]:
    return [path.read_text("utf-8") for path in sorted(watch.folder.glob(f"*/{REPORT}"))]


def test_an_error_in_a_slot_becomes_a_report_and_a_sentence(
    watch: CrashWatch, qtbot: QtBot, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    bar = CrashBar(watch, open_it=opened.append)
    qtbot.addWidget(bar)
    button = QPushButton("Fail")
    qtbot.addWidget(button)

    def fail() -> None:
        document = SECRET  # what a frame holds is not in the report
        raise ZeroDivisionError(f"{len(document) / 1:.0f} by nothing")

    button.clicked.connect(fail)
    for number in range(300):
        watch.note(f"tool.number_{number}")
    watch.note_gl("Mesa llvmpipe 4.5")
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    [text] = reports(watch)
    assert "ZeroDivisionError: 24 by nothing" in text
    assert "test_crash.py" in text
    assert "OpenGL Mesa llvmpipe 4.5" in text
    assert f"Python {sys.version.split()[0]}" in text
    assert "tool.number_299" in text
    assert "tool.number_99\n" not in text
    assert sum(line.startswith("tool.number_") for line in text.splitlines()) == LAST_COMMANDS
    assert SECRET not in text
    assert os.path.expanduser("~") not in text
    assert not bar.isHidden()
    assert "ZeroDivisionError: 24 by nothing" in bar.sentence.text()
    qtbot.mouseClick(bar.buttons["Copy details"], Qt.MouseButton.LeftButton)
    assert QGuiApplication.clipboard().text() == text
    qtbot.mouseClick(bar.buttons["Open folder"], Qt.MouseButton.LeftButton)
    assert (Path(opened[0]) / REPORT).is_file()
    qtbot.mouseClick(bar.close_button, Qt.MouseButton.LeftButton)
    assert bar.isHidden()
    assert watch.last_run() is None  # it was told
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_the_same_fault_is_told_once_and_many_are_limited(watch: CrashWatch) -> None:
    told: list[str] = []
    watch.happened.connect(lambda words, folder: told.append(words))

    def fail(words: str) -> None:
        raise RuntimeError(words)

    for number in range(5):
        try:
            fail(f"number {number}")
        except RuntimeError as error:
            sys.excepthook(RuntimeError, error, error.__traceback__)
    assert len(told) == len(reports(watch)) == 1
    for number in range(2 * MOST_REPORTS):
        try:
            exec(compile("\n" * number + "raise RuntimeError('another place')", "made up", "exec"))
        except RuntimeError as error:
            sys.excepthook(RuntimeError, error, error.__traceback__)
    assert len(told) == len(reports(watch)) == MOST_REPORTS


def test_an_error_on_another_thread_is_told_on_that_of_the_window(watch: CrashWatch, qtbot: QtBot) -> None:
    bar = CrashBar(watch)
    qtbot.addWidget(bar)

    def fail() -> None:
        raise LookupError("no such hair")

    thread = threading.Thread(target=fail, name="counter")
    thread.start()
    thread.join()
    qtbot.waitUntil(lambda: not bar.isHidden())
    assert "on the thread counter:" in reports(watch)[0]


def test_a_run_that_ends_well_leaves_nothing(tmp_path: Path, qtbot: QtBot) -> None:
    watch = CrashWatch(tmp_path / "crashes")
    watch.install()
    assert len(list(watch.folder.iterdir())) == 1
    watch.close()
    assert list(watch.folder.iterdir()) == []
    assert CrashWatch(tmp_path / "crashes").last_run() is None


def die(folder: Path, how: str) -> None:
    """A program of ours that ends so."""
    code = (
        "import sys, os, faulthandler, signal\n"
        "from pathlib import Path\n"
        "from app.window.crash import CrashWatch\n"
        "watch = CrashWatch(Path(sys.argv[1]))\n"
        "watch.install()\n"
        "watch.note('tool.comb')\n"
        "watch.note_gl('Mesa')\n" + how
    )
    done = subprocess.run([sys.executable, "-c", code, str(folder)], capture_output=True, check=False, timeout=120)
    assert done.returncode != 0


def test_a_fault_of_native_code_is_mentioned_at_the_next_start_and_once(tmp_path: Path, qtbot: QtBot) -> None:
    folder = tmp_path / "crashes"
    die(folder, "faulthandler._sigsegv()")
    watch = CrashWatch(folder)
    watch.install()  # its own run is not mistaken for the dead one
    bar = CrashBar(watch)
    qtbot.addWidget(bar)
    bar.tell_of_last_run(watch)
    assert "the last time" in bar.sentence.text()
    [text] = reports(watch)
    assert "Segmentation fault" in text
    assert "command tool.comb" in text
    assert "OpenGL Mesa" in text
    assert watch.last_run() is None
    watch.close()
    assert [path for path in folder.iterdir() if path.is_file()] == []


def test_an_error_that_ends_the_program_is_mentioned_but_a_kill_is_not(tmp_path: Path, qtbot: QtBot) -> None:
    folder = tmp_path / "crashes"
    die(folder, "os.kill(os.getpid(), signal.SIGKILL)")
    assert CrashWatch(folder).last_run() is None  # recovery is what is offered then
    die(folder, "raise ValueError('before there is a window')")
    found = CrashWatch(folder).last_run()
    assert found is not None
    assert "before there is a window" in (Path(found) / REPORT).read_text("utf-8")


def test_a_folder_that_cannot_be_written_stops_nothing(tmp_path: Path, qtbot: QtBot) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    watch = CrashWatch(blocked / "crashes")
    watch.install()
    watch.note("edit.undo")
    assert watch.report(ValueError("a")) is None
    assert watch.last_run() is None
    watch.close()


def test_reports_lie_beside_the_journals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FILOPLUME_STATE", str(tmp_path))
    assert crash_folder() == tmp_path / "crashes"
    monkeypatch.delenv("FILOPLUME_STATE")
    assert crash_folder().name == "crashes"
    assert "filoplume" in str(crash_folder())
