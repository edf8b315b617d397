"""The manual's goldfinch by hand: what it says, and a hand that does it in the real window.

:data:`STEPS` is the one source of the chapter in feather.md, of its pictures, and of the test that follows it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QInputDialog, QLineEdit, QWidget

from app.window.craft_panels import CoatPanel
from app.window.fields.number_bar import NumberBar
from app.window.fields.value_field import ValueField
from core.camera import project
from docs.first_groom import Step, find_command, size_of_brush, sweep, type_number
from tests.window.hand import Hand, Place

SIZE = (1600, 980)
OPEN, FOLDED = 1022, 1001
CROWN = (0.0, 0.103, 0.040)  # metres, on the bird
BREAST = ((0.015, 0.066, 0.028), (0.018, 0.058, 0.014), (0.017, 0.048, 0.0))


def command(hand: Hand, words: str) -> None:
    """Ctrl+K, a few words, Return."""
    palette = find_command(hand, words)
    QTest.keyClick(palette.line, Qt.Key.Key_Return)
    hand.until(lambda: QApplication.activePopupWidget() is None)
    hand.rest()


def look_from(hand: Hand, side: str) -> None:
    """The view from a side."""
    hand.window.commands.run(f"view.{side}")
    hand.rest()


def on_screen(hand: Hand, place: tuple[float, float, float]) -> Place:
    """Where a place of the scene is, as fractions of the view."""
    view = hand.window.viewport
    width, height = view.pixels()
    x, y = project(view.eye.camera, np.array([place]), width, height).xy[0]
    return float(x) / width, float(y) / height


def type_into(hand: Hand, field: QWidget, text: str) -> None:
    """A number typed on a bar."""
    bar: Any = field.bar if isinstance(field, ValueField) else field
    assert isinstance(bar, NumberBar)
    bar.start_typing(text)
    QTest.keyClick(bar.line, Qt.Key.Key_Return)
    hand.rest()


def go_to(hand: Hand, frame: int) -> None:
    """The timeline at a frame."""
    hand.window.desk.set_workspace(frame=float(frame))
    hand.rest()


def opens(hand: Hand, folder: Path) -> None:
    hand.window.commands.run("file.demo_bird")  # there is no view yet to press a key in
    hand.until(lambda: bool(hand.window.desk.document.meshes), 60_000)
    hand.until(hand.window.viewport.isExposed)
    hand.rest()
    look_from(hand, "left")


def dresses(hand: Hand, folder: Path) -> None:
    command(hand, "dress with feathers")
    hand.until(lambda: bool(hand.window.desk.document.feathers), 120_000)
    hand.window.commands.run("window.craft_groom")
    hand.rest()


def widens(hand: Hand, folder: Path) -> None:
    type_number(hand, CoatPanel, "width", "1.15")


def caps(hand: Hand, folder: Path) -> None:
    look_from(hand, "top")
    hand.window.commands.run("tool.lasso")
    x, y = on_screen(hand, CROWN)
    w, h = 0.034, 0.055
    sweep(hand, (x - w, y - h), (x + w, y - h), (x + w, y + h), (x - w, y + h), (x - w, y - h))
    hand.rest()
    command(hand, "tract along selected")
    hand.until(lambda: isinstance(QApplication.activeModalWidget(), QInputDialog))
    dialog = QApplication.activeModalWidget()
    assert dialog is not None
    line = dialog.findChild(QLineEdit)
    assert isinstance(line, QLineEdit)
    QTest.keyClicks(line, "cap")
    QTest.keyClick(line, Qt.Key.Key_Return)
    hand.rest()


def combs(hand: Hand, folder: Path) -> None:
    look_from(hand, "left")
    hand.window.commands.run("groom.select_none")
    hand.window.commands.run("tool.comb")
    size_of_brush(hand, 60)
    sweep(hand, *(on_screen(hand, place) for place in BREAST))
    hand.rest()


def unfolds(hand: Hand, folder: Path) -> None:
    go_to(hand, OPEN)
    look_from(hand, "three_quarter")


def fans(hand: Hand, folder: Path) -> None:
    command(hand, "edit the feather")
    wings = hand.window.feather_side.wings
    wings.wing.enter(hand.window.desk.document.feathers[0].wings[-1].id)
    field: Any = wings.forms["wing"].fields["fan"]
    for frame, number in ((FOLDED, "0.7"), (OPEN, "1.5")):
        go_to(hand, frame)
        type_into(hand, field, number)
        if frame == FOLDED:
            field.toggle_key()
            hand.rest()


def spreads(hand: Hand, folder: Path) -> None:
    wings = hand.window.feather_side.wings
    coat = hand.window.desk.document.feathers[0]
    wings.wing.enter(coat.wings[0].id)
    row = next(row for row in coat.wings[0].rows if row.name == "primaries")
    wings.row.enter(row.id)
    wings.feather.enter(row.count)
    type_into(hand, wings.forms["feather"].fields["spread"], "12")
    hand.rest()


STEPS = (
    Step("Open the bare bird",
         "`Ctrl+K`, *Open the demo bird* (or `filoplume demo bird`, `filoplume out/bare-bird.filo`): a finch without a "
         "feather, its wings folded. Look at it from the left. Birds of your own need joints called *humerus*, "
         "*forearm* and *hand*, one below the other, on each side, and *tail*; parts of the mesh with *beak*, *eye* or "
         "*feet* in their names stay bare.", opens),
    Step("Dress it",
         "`Ctrl+K`, *Dress with feathers*. 4,000 feathers lie along the body, and wings and tail have theirs: nine "
         "primaries on each hand, nine secondaries on each forearm, three tertials, the alula, and rows of coverts "
         "over and under them that run on into the body. In the craft **Groom** the brushes are at hand, and what they "
         "comb are the keys.", dresses, ("Dress with feathers",)),
    Step("Close the coat",
         "In the panel **Feathers** set **Width** to `1.15`: wider vanes hide more of their neighbours.", widens,
         ("Feathers width",)),
    Step("Give it a cap",
         "From above, take the **Lasso** and draw around the keys on the crown. `Ctrl+K`, *Tract along selected keys*, "
         "and name it `cap`: the band wears the black feathers that a goldfinch has there. `back` is another part that "
         "it knows.", caps, ("Lasso", "Tract along keys")),
    Step("Comb it",
         "From the left, with nothing selected, take the **Comb** and stroke the breast down and back. When the hand "
         "rests all feathers are laid anew, over one another, and out of the way of the wings.", combs,
         ("Select none", "Comb")),
    Step("Open the wings",
         f"Go to frame {OPEN}. The joints open the wing, and the fan goes with them: every primary slides out from "
         "under the next, coverts follow their quills, feathers of the flank make way. Any rotation of the joints does "
         "it, by the clip or by **Rotate** in the craft **Pose**.", unfolds),
    Step("Fan the tail",
         "`Ctrl+K`, *Edit the feather*, and under **Wings** choose the tail. "
         f"At frame {FOLDED} set **Fan** to `0.7` and press its diamond, which keys it; at frame {OPEN} set `1.5`, "
         "which is the second key. Their curve is below the timeline, with all others.", fans,
         ("Wing", "Wing", "Wing")),
    Step("Move one quill",
         "Choose a wing, the row *primaries* and feather `9`, the outermost, and set **Spread** to `12`°. Lift, bend "
         "and twist are there too; each may be keyed, or follow an expression of `k`, `number`, `open` and `frame`.",
         spreads, ("Feather of the wing",)),
)


def picture_of(number: int) -> str:
    """The file of the picture after a step."""
    return f"bird-step-{number}.jpg"


def chapter() -> str:
    """The walk-through as Markdown."""
    return "\n\n".join(
        f"**{number}. {step.title}.** {step.words}\n\n![{step.title}](pictures/{picture_of(number)})"
        for number, step in enumerate(STEPS, 1))
