"""Slow work: results and progress come to the thread of the window, cancelling is quick, threads end."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, Qt, QThread
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.jobs import SHOWN_AFTER, Cancelled, JobsBar
from core.errors import UserError
from tools.session import Session


@pytest.fixture
def desk(qtbot: QtBot) -> Iterator[Desk]:
    desk = Desk(Session())
    yield desk
    assert desk.jobs.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("job ")]
    desk.session.close(discard=True)


def _until_cancelled(progress: Any, cancelled: Any) -> None:
    while True:
        time.sleep(0.01)
        progress(0.5)


def test_a_result_comes_to_the_thread_of_the_window(desk: Desk, qtbot: QtBot) -> None:
    window = threading.get_ident()
    seen: list[tuple[int, int, list[float]]] = []
    fractions: list[float] = []
    desk.jobs.changed.connect(lambda: fractions.extend(job.fraction for job in desk.jobs.running))

    def work(progress: Any, cancelled: Any) -> int:
        progress(0.25)
        progress(1.7)
        return threading.get_ident()

    desk.jobs.start("Count", work, lambda worker: seen.append((worker, threading.get_ident(), [])))
    qtbot.waitUntil(lambda: bool(seen))
    worker, here, _ = seen[0]
    assert worker != window
    assert here == window
    assert desk.jobs.running == ()
    assert all(-1.0 <= fraction <= 1.0 for fraction in fractions)


def test_what_goes_wrong_is_said_with_details(desk: Desk, qtbot: QtBot) -> None:
    said: list[tuple[str, str]] = []
    desk.failed.connect(lambda sentence, details: said.append((sentence, details)))

    def user_error(progress: Any, cancelled: Any) -> None:
        raise UserError("There is no paper in the printer.")

    def fault(progress: Any, cancelled: Any) -> None:
        raise ZeroDivisionError("one by nothing")

    desk.jobs.start("Print", user_error, lambda result: pytest.fail("it did not work"))
    qtbot.waitUntil(lambda: len(said) == 1)
    assert said[0] == ("There is no paper in the printer.", "")
    desk.jobs.start("Divide", fault, lambda result: pytest.fail("it did not work"))
    qtbot.waitUntil(lambda: len(said) == 2)
    assert said[1][0].startswith("Divide did not work: one by nothing.")
    assert "ZeroDivisionError" in said[1][1]
    caught: list[Exception] = []
    desk.jobs.start("Divide", fault, lambda result: None, caught.append)
    qtbot.waitUntil(lambda: bool(caught))
    assert isinstance(caught[0], ZeroDivisionError)
    assert len(said) == 2


def test_an_error_in_the_answer_to_a_result_is_said_too(desk: Desk, qtbot: QtBot) -> None:
    said: list[str] = []
    desk.failed.connect(lambda sentence, details: said.append(sentence))

    def put(result: object) -> None:
        raise UserError("There is no room for it.")

    desk.jobs.start("Fetch", lambda progress, cancelled: 1, put)
    qtbot.waitUntil(lambda: said == ["There is no room for it."])


def test_a_job_that_is_cancelled_ends_and_gives_nothing(desk: Desk, qtbot: QtBot) -> None:
    said: list[str] = []
    desk.said.connect(said.append)
    job = desk.jobs.start("Wait", _until_cancelled, lambda result: pytest.fail("it was cancelled"))
    qtbot.waitUntil(lambda: job.fraction == 0.5)
    desk.jobs.cancel(job)
    assert job.stopping
    qtbot.waitUntil(lambda: not desk.jobs.running, timeout=200)
    assert said == ["Wait: cancelled."]
    deaf = threading.Event()

    def deaf_work(progress: Any, cancelled: Any) -> int:
        deaf.wait(20.0)
        return 1

    job = desk.jobs.start("Deaf", deaf_work, lambda result: pytest.fail("it was cancelled"))
    desk.jobs.cancel(job)
    deaf.set()
    qtbot.waitUntil(lambda: not desk.jobs.running)
    assert said[-1] == "Deaf: cancelled."


def test_a_cancelled_job_may_say_what_it_keeps(desk: Desk, qtbot: QtBot) -> None:
    said: list[str] = []
    desk.said.connect(said.append)

    def work(progress: Any, cancelled: Any) -> None:
        while not cancelled():
            time.sleep(0.005)
        raise Cancelled("7 pictures are kept.")

    desk.jobs.cancel(desk.jobs.start("Draw", work, lambda result: None))
    qtbot.waitUntil(lambda: said == ["7 pictures are kept."])


def test_a_job_asks_the_window_and_waits(desk: Desk, qtbot: QtBot) -> None:
    answers: list[Any] = []
    window = QThread.currentThread()

    def slices(count: int) -> Iterator[int]:
        for number in range(count):
            assert QThread.currentThread() is window
            yield number

    def refuse() -> None:
        raise UserError("No.")

    def work(progress: Any, cancelled: Any) -> list[Any]:
        found: list[Any] = [desk.jobs.on_window(lambda: QThread.currentThread() is window)]
        found.append(desk.jobs.on_window(slices, 5))
        try:
            desk.jobs.on_window(refuse)
        except UserError as error:
            found.append(str(error))
        return found

    desk.jobs.start("Ask", work, answers.append)
    qtbot.waitUntil(lambda: bool(answers))
    assert answers == [[True, 4, "No."]]


def test_nothing_is_delivered_to_a_widget_that_is_gone(desk: Desk, qtbot: QtBot) -> None:
    widget = QWidget()
    begun = threading.Event()
    desk.jobs.start("Look", lambda progress, cancelled: begun.wait(5.0), lambda result: pytest.fail("it is gone"),
                    owner=widget)
    widget.deleteLater()
    del widget
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    begun.set()
    qtbot.waitUntil(lambda: not desk.jobs.running)


def test_closing_ends_every_job_even_one_that_waits_for_the_window(desk: Desk) -> None:
    begun = threading.Event()

    def ask(progress: Any, cancelled: Any) -> None:
        begun.set()
        desk.jobs.on_window(lambda: None)

    desk.jobs.start("Ask", ask, lambda result: None)
    for _ in range(3):
        desk.jobs.start("Wait", _until_cancelled, lambda result: None)
    assert begun.wait(5.0)
    assert desk.jobs.close()
    assert desk.jobs.running == ()
    QCoreApplication.processEvents()
    late = desk.jobs.start("Late", _until_cancelled, lambda result: pytest.fail("the desk is closed"))
    assert late.thread is None


def test_thousands_of_reports_from_many_threads_arrive(desk: Desk, qtbot: QtBot) -> None:
    sums: list[int] = []

    def work(progress: Any, cancelled: Any) -> int:
        for step in range(2000):
            progress(step / 2000)
        return 1

    for _ in range(8):
        desk.jobs.start("Report", work, sums.append)
    qtbot.waitUntil(lambda: sum(sums) == 8, timeout=20_000)


def test_the_bar_shows_what_takes_long_and_cancels_it(desk: Desk, qtbot: QtBot) -> None:
    bar = JobsBar(desk.jobs)
    qtbot.addWidget(bar)
    assert bar.isHidden()
    desk.jobs.start("Quick", lambda progress, cancelled: 1, lambda result: None)
    assert bar.isHidden()
    job = desk.jobs.start("Read cat.obj", _until_cancelled, lambda result: None)
    assert bar.isHidden()
    qtbot.waitUntil(lambda: not bar.isHidden(), timeout=SHOWN_AFTER + 2000)
    assert bar.name.text() == "Read cat.obj"
    qtbot.waitUntil(lambda: bar.bar.value() == 500)
    qtbot.mouseClick(bar.stop, Qt.MouseButton.LeftButton)
    assert job.stopping
    assert not bar.stop.isEnabled()
    qtbot.waitUntil(bar.isHidden, timeout=200)


def test_usd_is_loaded_before_there_is_a_worker() -> None:
    """Loading it beside another library stops the program: every module of it that is used comes with the jobs."""
    root = Path(__file__).resolve().parents[2]
    sources = [path.read_text(encoding="utf-8") for room in ("app", "core") for path in (root / room).rglob("*.py")]
    used = {name for text in sources for line in re.findall(r"from pxr import ([\w, ]+)", text)
            for name in re.findall(r"\w+", line)}
    assert "UsdGeom" in used
    loaded = subprocess.run(
        [sys.executable, "-c", "import sys, app.window.jobs; print(*sys.modules)"], cwd=root, capture_output=True,
        text=True, check=True, timeout=60).stdout.split()
    assert used <= {name.removeprefix("pxr.") for name in loaded}
