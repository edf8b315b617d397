"""Windows of tests."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.display import ensure_display

OFFSCREEN = ensure_display()  # before anything of Qt is made

from pytestqt.qtbot import QtBot  # noqa: E402
from shiboken6 import isValid  # noqa: E402

from app.window.main import MainWindow, fresh_workspace  # noqa: E402
from app.window.settings import Settings  # noqa: E402
from core.demo import demo_document  # noqa: E402
from core.document import Document  # noqa: E402
from core.evaluator import Evaluator  # noqa: E402
from core.formats.journal import Journal  # noqa: E402
from tests.documents import small_document  # noqa: E402
from tests.window.hand import Hand  # noqa: E402
from tests.window.host import Host  # noqa: E402
from tools.session import Session  # noqa: E402

Opened = Callable[..., Hand]


@pytest.fixture(autouse=True)
def rings_collected_here() -> Iterator[None]:
    """Rings with widgets in them are collected between tests, on this thread (see app/window/garbage.py)."""
    gc.disable()
    gc.freeze()  # what there is already need not be gone through again after every test
    yield
    gc.collect()
    gc.unfreeze()
    gc.enable()


@pytest.fixture
def host(qtbot: QtBot) -> Iterator[Host]:
    """A window with a small document in it, shown."""
    host = Host(small_document())
    host.resize(900, 600)
    with qtbot.waitExposed(host):
        host.show()
    yield host
    host.close()
    host.desk.session.close(discard=True)
    host.deleteLater()


class KeptEvaluator(Evaluator):
    """Remembers what one window's animal took to make for the next window, which closes it as little."""

    def close(self) -> None:
        """Nothing: the end of the tests is its end."""


@pytest.fixture(scope="session")
def evaluator() -> Iterator[Evaluator]:
    """What the windows of all tests remember; by identity, so no test can see another's document."""
    kept = KeptEvaluator()
    yield kept
    Evaluator.close(kept)


@pytest.fixture(scope="session")
def animal(evaluator: Evaluator) -> Document:
    """The demo animal with few guides and hairs."""
    return demo_document(evaluator, hairs=4000, guides=400)


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Preferences and journals of this test alone."""
    monkeypatch.setenv("FILOPLUME_STATE", str(tmp_path / "journals"))
    monkeypatch.setenv("FILOPLUME_SETTINGS", str(tmp_path / "settings"))
    return tmp_path


@pytest.fixture
def opened(qtbot: QtBot, home: Path, evaluator: Evaluator) -> Iterator[Opened]:
    """Opens real main windows: ``opened(document, keymap="maya")`` gives a hand at one."""
    if OFFSCREEN is not None or os.environ.get("QT_QPA_PLATFORM") == "offscreen":
        pytest.skip(OFFSCREEN or "windows are offscreen")
    windows: list[MainWindow] = []

    def open_one(document: Document | None = None, **settings: object) -> Hand:
        session = Session(document, fresh_workspace(), journal=Journal(), evaluator=evaluator)
        window = MainWindow(session, Settings(**settings))  # type: ignore[arg-type]
        window.resize(900, 640)
        windows.append(window)
        window.show()
        qtbot.waitExposed(window)
        hand = Hand(window, qtbot)
        if document is not None and document.meshes:
            qtbot.waitUntil(lambda: window.viewport.isExposed(), timeout=10_000)
            hand.rest()
        return hand

    yield open_one
    for window in windows:
        if isValid(window):  # a test may have closed it
            window.close()
        qtbot.wait(1)


@pytest.fixture
def hand(opened: Opened, animal: Document) -> Hand:
    """A hand at a window with the animal in it."""
    return opened(animal)
