"""Rings with widgets in them are collected by the thread of the window, whatever other threads make."""

from __future__ import annotations

import gc
import threading
import weakref

from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.window.garbage import EVERY, Garbage


class Ring(QWidget):
    """A widget that refers to itself."""

    def __init__(self, died: list[str]) -> None:
        super().__init__()
        self.me = self
        weakref.finalize(self, lambda: died.append(threading.current_thread().name))


def make_many(kept: list[list[int]]) -> None:
    """What would set off Python's own collector many times."""
    kept += ([number] for number in range(200_000))


def test_other_threads_collect_nothing_and_the_window_does(qtbot: QtBot) -> None:
    was_on = gc.isenabled()
    garbage = Garbage()
    garbage.look()  # what is there by now is left alone
    died: list[str] = []
    kept: list[list[int]] = []
    for _ in range(20):
        Ring(died)
    thread = threading.Thread(target=make_many, args=(kept,), name="worker")
    thread.start()
    thread.join()
    assert died == []
    qtbot.waitUntil(lambda: len(died) == 20, timeout=20 * EVERY)
    assert set(died) == {threading.main_thread().name}
    garbage.stop()
    assert gc.isenabled() == was_on
    assert gc.get_freeze_count() == 0


def test_a_ring_that_was_alive_for_long_goes_after_a_dozen_looks() -> None:
    garbage = Garbage()
    garbage.look()
    died: list[str] = []
    ring = Ring(died)
    gc.collect()  # it lives on, and is old by now
    del ring
    kept: list[list[int]] = []
    for _ in range(12):
        kept += ([number] for number in range(2 * gc.get_threshold()[0]))
        garbage.look()
    assert died
    garbage.stop()
