"""Work of killed programs is offered in a bar; broken journals stop nothing; nothing is deleted."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.files.recovery_bar import MOST_TRASH, RecoveryBar, find_lost, put_aside
from core.formats.journal import Journal
from core.formats.recovery import abandoned
from tests.documents import small_document, stroked
from tools.session import Session

KILLED = """
import os, signal, sys
from pathlib import Path
from core.formats.journal import Journal
from tests.documents import small_document, stroked
from tools.session import Session
folder, project, steps = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
session = Session(small_document(), journal=Journal(folder), path=Path(project) if project else None)
for step in range(steps):
    session.edit(f"Comb {step}", stroked, step)
session._journal.flush()
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session())
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


def killed(folder: Path, project: str = "", steps: int = 3) -> None:
    """A program that is killed after some steps."""
    folder.mkdir(exist_ok=True)
    done = subprocess.run([sys.executable, "-c", KILLED, str(folder), project, str(steps)], check=False, timeout=120)
    assert done.returncode == -9


def bar_of(desk: Desk, folder: Path, qtbot: QtBot) -> RecoveryBar:
    bar = RecoveryBar(desk, folder, open_it=lambda folder: opened.append(folder))
    opened.clear()
    qtbot.addWidget(bar)
    bar.look()
    qtbot.waitUntil(lambda: not desk.jobs.running)
    return bar


opened: list[object] = []


def test_work_is_offered_and_recovered(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    killed(tmp_path, "/shots/Katze 猫.filo")
    said: list[str] = []
    desk.said.connect(said.append)
    bar = bar_of(desk, tmp_path, qtbot)
    assert not bar.isHidden()
    assert "Katze 猫.filo" in bar.sentence.text()
    assert "today at" in bar.sentence.text()
    assert "“Comb 2”" in bar.sentence.text()
    qtbot.mouseClick(bar.buttons["Show folder"], Qt.MouseButton.LeftButton)
    assert opened == [tmp_path]
    tools = desk.session.tools
    qtbot.mouseClick(bar.buttons["Recover"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: bool(desk.document.grooms))
    expected = small_document()
    for step in range(3):
        expected = stroked(expected, step)
    assert desk.document.grooms[0].guides.points.tobytes() == expected.grooms[0].guides.points.tobytes()
    assert desk.session.path == Path("/shots/Katze 猫.filo")
    assert desk.session.tools is tools
    assert not desk.session.saved
    assert bar.isHidden()
    assert said == ["Recovered as it was after “Comb 2”."]
    assert abandoned(tmp_path) == []  # it is in the journal of the session that goes on


def test_what_is_discarded_lies_in_the_trash_and_the_next_is_offered(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    killed(tmp_path, "/shots/older.filo", 1)
    killed(tmp_path, "", 2)
    bar = bar_of(desk, tmp_path, qtbot)
    assert len(bar.lost) == 2
    assert "a document without a name" in bar.sentence.text()
    assert "1 more" in bar.sentence.text()
    qtbot.mouseClick(bar.buttons["Discard"], Qt.MouseButton.LeftButton)
    assert "older.filo" in bar.sentence.text()
    qtbot.mouseClick(bar.buttons["Later"], Qt.MouseButton.LeftButton)
    assert bar.isHidden()
    assert len(list((tmp_path / "trash").glob("*.journal"))) == 1
    assert [lost.project for lost in find_lost(tmp_path)] == ["/shots/older.filo"]
    assert not desk.document.meshes


def test_a_broken_journal_is_put_aside_without_a_word(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    for name, content in (("20260101-000000-1-a", b""), ("20260101-000000-2-b", os.urandom(5000))):
        (tmp_path / f"{name}.journal").write_bytes(content)
    failed: list[str] = []
    desk.failed.connect(lambda sentence, details: failed.append(sentence))
    bar = bar_of(desk, tmp_path, qtbot)
    assert bar.isHidden()
    assert not failed
    assert abandoned(tmp_path) == []
    assert len(list((tmp_path / "trash").iterdir())) == 2


def test_no_folder_is_no_work_and_a_living_journal_is_left_alone(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    bar = bar_of(desk, tmp_path / "nowhere", qtbot)
    assert bar.isHidden()
    living = Session(small_document(), journal=Journal(tmp_path))
    living.edit("Comb", stroked, 1)
    assert find_lost(tmp_path) == []
    living.close()
    assert len(find_lost(tmp_path)) == 1


def test_work_that_is_gone_by_now_is_said_in_words(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    killed(tmp_path)
    failed: list[str] = []
    desk.failed.connect(lambda sentence, details: failed.append(sentence))
    bar = bar_of(desk, tmp_path, qtbot)
    [token] = abandoned(tmp_path)
    (tmp_path / f"{token}.journal").write_bytes(b"gone")
    before = desk.session
    qtbot.mouseClick(bar.buttons["Recover"], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: bool(failed))
    assert desk.session is before
    assert bar.isHidden()


def test_the_trash_keeps_the_newest(tmp_path: Path) -> None:
    for number in range(MOST_TRASH + 5):
        (tmp_path / f"20260101-{number:06}-1-a.journal").write_bytes(b"x")
        put_aside(tmp_path, f"20260101-{number:06}-1-a")
    kept = sorted(path.name for path in (tmp_path / "trash").iterdir())
    assert len(kept) == MOST_TRASH
    assert kept[-1] == f"20260101-{MOST_TRASH + 4:06}-1-a.journal"
