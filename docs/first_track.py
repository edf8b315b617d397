"""The manual's first tracks by hand: what it says, and a hand that does it in the real window, on a real plate.

:data:`STEPS` is the one source of the chapter in match.md, of its pictures, and of the test that follows it.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from app.window.match.track_list import TrackList
from core.image.plate_view import view_points
from docs.first_groom import Step
from tests.window.hand import ALT, CTRL, LEFT, NONE, Hand

SIZE = (1600, 980)
SINTEL = Path("matchmove/seq_sintel_raft/demo-frames")  # Blender Foundation, CC BY 3.0
CORNERS = np.array([
    [93.0, 242.0], [252.0, 290.0], [351.0, 147.0], [601.0, 31.0], [845.0, 21.0],
    [716.0, 173.0], [942.0, 231.0], [536.0, 364.0], [730.0, 343.0], [700.0, 200.0]])

ANOTHER = np.array([870.0, 136.0])


def pixel_of(hand: Hand, place: NDArray[np.float64]) -> QPoint:
    """The pixel of the view that shows a place of the plate."""
    x, y = view_points(hand.view.eye.camera, 1.0, place, *hand.view.pixels())[0]
    ratio = hand.view.devicePixelRatio()
    return QPoint(round(x / ratio), round(y / ratio))


def opens(hand: Hand, folder: Path) -> None:
    hand.window.opening.open(Path(os.environ["FILOPLUME_DATA"]) / SINTEL)
    hand.until(lambda: bool(hand.window.desk.document.plates), 60_000)
    hand.until(hand.window.viewport.isExposed)
    hand.rest()


def places(hand: Hand, folder: Path) -> None:
    for place in CORNERS:
        at = pixel_of(hand, place)
        QTest.mouseMove(hand.view, at)
        QTest.mouseClick(hand.view, LEFT, NONE, at)
        hand.painted()
    hand.rest()


def runs(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_T, CTRL | ALT)
    hand.until(lambda: hand.window.desk.session.history.undo_name == "Track both ways", 240_000)
    hand.rest()


def looks(hand: Hand, folder: Path) -> None:
    rows = hand.window.findChild(TrackList).list
    worst = rows.topLevelItem(0)
    QTest.mouseClick(rows.viewport(), LEFT, NONE, rows.visualItemRect(worst).center())
    hand.rest()


def mends(hand: Hand, folder: Path) -> None:
    """The track ends before the apple; another corner of the house takes its place."""
    desk = hand.window.desk
    for _ in range(2):
        hand.key(Qt.Key.Key_Left)
        hand.rest()
    hand.window.commands.run("match.clear_after")
    hand.rest()
    at = pixel_of(hand, ANOTHER)
    QTest.mouseMove(hand.view, at)
    QTest.mouseClick(hand.view, LEFT, NONE, at)
    hand.rest()
    hand.window.commands.run("match.both")
    hand.until(lambda: desk.session.history.undo_name == "Track both ways", 240_000)
    hand.rest()


STEPS = (
    Step("Open the plate",
         "File, Open plate, any of its frames; or drop its folder on the window. Pan with the buttons of the camera, "
         "zoom with the wheel, Home shows all of it.", opens, ("Open plate",)),
    Step("Place ten tracks",
         "With **Track point** click ten corners, well spread, near and far. The box under the pointer is the pattern "
         "that will be followed, the dashed one is how far it is looked for.", places, ("Track point",) * 10),
    Step("Let it run",
         "Ctrl-Alt-T follows them all through the plate, in the background; Cancel leaves everything as it was. The "
         "list has the worst track first: *track_07* is five times as unsure as the next.", runs, ("Track both ways",)),
    Step("See which is bad, and why",
         "Click it in the list: the plate goes to its worst frame. At the lower right stand the pattern at its key, as "
         "it is now, and what differs. An apple has come before the corner, and the curve of its motion turns where "
         "no camera did.", looks),
    Step("Mend it",
         "Two frames back the corner is still free. *Forget after here* (menu Match) ends the track there; click "
         "another corner, and *Track both ways* follows it from here to both ends. A point that only slipped is "
         "dragged back instead, with Ctrl a tenth as far as the hand, and Alt-T tracks between its two keys; what "
         "comes before many tracks is held off by a **Roto mask**.",
         mends, ("Forget after", "Track point", "Track both ways")),
)


def picture_of(number: int) -> str:
    """The file of the picture after a step."""
    return f"match-step-{number}.jpg"


def chapter() -> str:
    """The walk-through as Markdown."""
    return "\n\n".join(
        f"**{number}. {step.title}.** {step.words}\n\n![{step.title}](pictures/{picture_of(number)})"
        for number, step in enumerate(STEPS, 1))
