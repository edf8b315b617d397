"""The manual's first model of photographs: what it says, and a hand that does it in the real window.

:data:`STEPS` is the one source of the chapter in model.md, of its pictures, and of the test that follows it. The
photographs are drawn by the tests' house of known measures.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QInputDialog

from core.image.plate_view import view_points
from core.match.photomodel.records import Photomodel
from docs.first_groom import Step
from tests.window.hand import ALT, LEFT, NONE, SHIFT, Hand
from tests.window.match.photographs import corner, photographed
from tools.photomodel_edits import model_of

SIZE = (1600, 980)
CORNERS = (0, 1, 3, 4, 5, 7, 8, 9, 10, 11)  # of the house, in the order in which they are picked


def model(hand: Hand) -> Photomodel:
    """The model on the desk."""
    found = model_of(hand.window.desk.document)
    assert found is not None
    return found


def pixel_of(hand: Hand, place: np.ndarray) -> QPoint:
    """The pixel of the view that shows a place of the photograph."""
    x, y = view_points(hand.view.eye.camera, 1.0, place, *hand.view.pixels())[0]
    ratio = hand.view.devicePixelRatio()
    return QPoint(round(x / ratio), round(y / ratio))


def click(hand: Hand, number: int, keys: Qt.KeyboardModifier = NONE) -> None:
    """Click a corner of the house in the photograph in view."""
    at = pixel_of(hand, corner(number, round(hand.window.desk.workspace.frame)))
    QTest.mouseMove(hand.view, at)
    QTest.mouseClick(hand.view, LEFT, keys, at)
    hand.painted()


def take(hand: Hand, *numbers: int) -> None:
    """Take corners in hand, one after the other."""
    for count, number in enumerate(numbers):
        click(hand, number, SHIFT if count else NONE)
    hand.rest()


def go_on(hand: Hand) -> None:
    """The next photograph."""
    hand.key(Qt.Key.Key_N, ALT)
    hand.rest()


def answer(hand: Hand, command: str, words: str) -> None:
    """Run a command that asks for a number, and give it."""
    hand.window.commands.run(command)
    dialog = hand.window.findChild(QInputDialog)
    dialog.setTextValue(words)
    dialog.accept()
    hand.rest()


def opens(hand: Hand, folder: Path) -> None:
    hand.window.match.doors.open_plate(photographed(folder))
    hand.until(lambda: bool(hand.window.desk.document.plates), 60_000)
    hand.until(hand.window.viewport.isExposed)
    hand.rest()
    hand.window.commands.run("match.take_photographs")
    hand.rest()


def picks(hand: Hand, folder: Path) -> None:
    hand.window.desk.choose("pick_point")
    hand.rest()
    for number in CORNERS:
        for _ in range(3):
            click(hand, number)
            go_on(hand)


def solves(hand: Hand, folder: Path) -> None:
    hand.window.commands.run("match.solve_model")
    hand.rest()
    go_on(hand)
    take(hand, 8)


def says(hand: Hand, folder: Path) -> None:
    take(hand, 0, 1)
    answer(hand, "match.model_distance", "4")
    take(hand, 0, 1, 4, 5)
    hand.window.commands.run("match.know_parallel")
    hand.rest()
    take(hand, 0, 1, 3)
    hand.window.commands.run("match.model_plane")
    hand.rest()


def builds(hand: Hand, folder: Path) -> None:
    take(hand, 0, 1, 3, 4)
    hand.window.commands.run("match.build_box")
    hand.rest()
    take(hand, 4, 7, 9, 8)
    hand.window.commands.run("match.build_polygon")
    hand.rest()
    take(hand, 4, 8, 5)
    hand.window.commands.run("match.build_polygon")
    hand.rest()


def drags(hand: Hand, folder: Path) -> None:
    at = pixel_of(hand, corner(8, round(hand.window.desk.workspace.frame)))
    QTest.mousePress(hand.view, LEFT, NONE, at)
    for step in range(1, 9):
        QTest.mouseMove(hand.view, at + QPoint(4 * step, -3 * step))
        hand.painted()
    QTest.mouseRelease(hand.view, LEFT, NONE, at + QPoint(32, -24))
    hand.rest()


def lines_up(hand: Hand, folder: Path) -> None:
    """A model is begun by edges of one photograph, drawn along the axes."""
    desk = hand.window.desk
    hand.window.match.doors.open_plate(photographed(folder))
    hand.until(lambda: bool(desk.document.plates), 60_000)
    hand.until(hand.window.viewport.isExposed)
    desk.set_workspace(frame=2.0)
    desk.choose("line_up_axis")
    hand.rest()
    for start, end, keys in ((0, 1, NONE), (4, 5, NONE), (0, 3, SHIFT), (4, 7, SHIFT)):
        first, last = pixel_of(hand, corner(start, 2)), pixel_of(hand, corner(end, 2))
        QTest.mousePress(hand.view, LEFT, keys, first)
        for part in (0.25, 0.5, 0.75, 1.0):
            QTest.mouseMove(hand.view, first + (last - first) * part)
            hand.painted()
        QTest.mouseRelease(hand.view, LEFT, keys, last)
        hand.rest()


STEPS = (
    Step("Take the photographs in",
         "File, Open plate, one of them; stills whose names are numbered come in together, others one after the other. "
         "Match, Model of photographs, *Take photographs in*. A focal length in the file is used; where there is none "
         "it is found.", opens, ("Open plate", "Take photographs in")),
    Step("Pick ten corners",
         "With **Pick point** click a corner, press Alt-N, click it in the next photograph, and so on: the point stays "
         "in hand while the photographs go by. Alt-Shift-N goes back, Alt-P takes the next point that is not picked "
         "here. Edges without ends are picked by **Pick edge**, what is round by **Pick circle**.",
         picks, ("Pick point",) * 30),
    Step("Solve",
         "*Solve photomodel* finds where the photographs were taken and where the points are. Crosses turn green; the "
         "point in hand says by how much its pick misses. From now on a point has its place with the second pick and "
         "rings show where it is in the others; before that a dashed line says where it must lie.",
         solves, ("Solve photomodel", "Select points")),
    Step("Say what is known",
         "Shift-click takes several points in hand, their order counts. The front is 4 m wide (*Model scale*), its "
         "eaves are parallel to its foot (*Known parallel*), three corners are the ground (*Model ground*).", says),
    Step("Build",
         "A corner and the ends of its three edges make a box, points around a face a polygon. What is built is drawn "
         "in green over every photograph. *Model into the scene* makes it a mesh there; File, *Export model* writes it "
         "with UVs and the photographs projected onto it.", builds),
    Step("Drag a pick",
         "Cameras, points and what is built follow the hand; with Ctrl a tenth as far. The red line leads from the "
         "pick to where the other photographs say that it should be: this one is wrong, and undo takes it back.",
         drags, ("Move pick",)),
)

LINE_UP = (Step("Line up one photograph", "", lines_up, ("Open plate", *(("Line-up",) * 4))),)


def picture_of(number: int) -> str:
    """The file of the picture after a step."""
    return f"photomodel-step-{number}.jpg"


def chapter() -> str:
    """The walk-through as Markdown."""
    return "\n\n".join(
        f"**{number}. {step.title}.** {step.words}\n\n![{step.title}](pictures/{picture_of(number)})"
        for number, step in enumerate(STEPS, 1))
