"""The manual's first groom by hand: what it says, and a hand that does it in the real window.

:data:`STEPS` is the one source of the chapter in groom.md (written by ``make pictures``), of its pictures, and of the
test that follows it. The keys are those of the Blender keymap.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialogButtonBox, QFileDialog, QLineEdit, QWidget

from app.window.craft_panels import CoatPanel, RespectPanel, ToolPanel
from app.window.fields.value_field import ValueField
from app.window.files.playblast import PlayblastDialog
from app.window.palette import Palette
from tests.window.hand import CTRL, MIDDLE, NONE, SHIFT, Hand, Place

SIZE = (1600, 980)
Do = Callable[[Hand, Path], object]


class Step(NamedTuple):
    """One numbered step.

    title : a few words. words : what to do and what is seen, in Markdown. do : does it; a folder is for its files.
    made : the names of the steps that undo then knows it by.
    """

    title: str
    words: str
    do: Do
    made: tuple[str, ...] = ()


# -- what a hand does ------------------------------------------------------------------------------------------------


def sweep(hand: Hand, *places: Place) -> None:
    """One stroke through these places, with a picture after every sample."""
    hand.press(places[0])
    for start, end in pairwise(places):
        for part in (0.25, 0.5, 0.75, 1.0):
            hand.move((start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])))
            hand.painted()
    hand.release(places[-1])
    hand.painted()


def size_of_brush(hand: Hand, pixels: int) -> None:
    """F, the number, Return."""
    hand.move((0.5, 0.5))
    hand.key(Qt.Key.Key_F)
    for digit in str(pixels):
        hand.key(Qt.Key(ord(digit)))
    hand.key(Qt.Key.Key_Return)


def find_command(hand: Hand, words: str) -> Palette:
    """Ctrl+K and a few words; the palette stays open."""
    hand.key(Qt.Key.Key_K, CTRL)
    hand.until(lambda: isinstance(QApplication.activePopupWidget(), Palette))
    palette = QApplication.activePopupWidget()
    assert isinstance(palette, Palette)
    QTest.keyClicks(palette.line, words)
    return palette


def field(hand: Hand, panel: type[ToolPanel | RespectPanel | CoatPanel], name: str) -> QWidget:
    """The field of a panel by the name of what it edits, scrolled into sight."""
    names = {ToolPanel: "tool", RespectPanel: "respect", CoatPanel: "coat"}
    found = hand.window.panels[names[panel]]
    assert isinstance(found, panel)
    assert found.form is not None
    widget: Any = found.form.fields[name]
    return widget.bar if isinstance(widget, ValueField) else widget


def type_number(hand: Hand, panel: type[ToolPanel | CoatPanel], name: str, text: str) -> None:
    """A double click on a bar, the number, Return."""
    bar = field(hand, panel, name)
    QTest.mouseDClick(bar, Qt.MouseButton.LeftButton, NONE, bar.rect().center())
    hand.until(lambda: isinstance(bar.findChild(QLineEdit), QLineEdit))
    line = bar.findChild(QLineEdit)
    line.selectAll()
    QTest.keyClicks(line, text)
    QTest.keyClick(line, Qt.Key.Key_Return)
    hand.rest()


def switch(hand: Hand, panel: type[ToolPanel | RespectPanel], name: str) -> None:
    """A click on a bar that is on or off."""
    bar = field(hand, panel, name)
    QTest.mouseClick(bar, Qt.MouseButton.LeftButton, NONE, bar.rect().center())


def type_file(hand: Hand, path: Path) -> None:
    """A name into the file window that is open, and Save."""
    def dialog() -> QFileDialog | None:
        return next((w for w in hand.window.findChildren(QFileDialog) if w.isVisible()), None)

    hand.until(lambda: dialog() is not None)
    open_dialog = dialog()
    assert open_dialog is not None
    line = open_dialog.findChild(QLineEdit, "fileNameEdit")
    assert isinstance(line, QLineEdit)
    line.selectAll()
    QTest.keyClicks(line, str(path))
    button = open_dialog.findChild(QDialogButtonBox).button(QDialogButtonBox.StandardButton.Save)
    hand.until(button.isEnabled)

    def gone() -> bool:
        if dialog() is None:
            return True
        QTest.mouseClick(button, Qt.MouseButton.LeftButton, NONE, button.rect().center())
        return False

    hand.until(gone)  # a list of completions that opens meanwhile takes a click for itself, from people too
    hand.rest()


# -- the steps -------------------------------------------------------------------------------------------------------


def _open(hand: Hand, folder: Path) -> None:
    door = next(d for d in hand.window.doors.findChildren(QWidget) if getattr(d, "text", str)() == "Open the demo")
    QTest.mouseClick(door, Qt.MouseButton.LeftButton, NONE, door.rect().center())
    hand.until(lambda: bool(hand.window.desk.document.meshes), 60_000)
    hand.rest()


def _look(hand: Hand, folder: Path) -> None:
    hand.drag((0.5, 0.7), (0.44, 0.66), MIDDLE)
    hand.drag((0.5, 0.5), (0.52, 0.55), MIDDLE, SHIFT)
    hand.rest()
    hand.key(Qt.Key.Key_Home)
    hand.key(Qt.Key.Key_3, Qt.KeyboardModifier.KeypadModifier)
    hand.rest()


NECK: tuple[Place, ...] = ((0.715, 0.29), (0.68, 0.36), (0.645, 0.42), (0.60, 0.455), (0.55, 0.47))
LOCK, RUMP = (0.60, 0.56), (0.36, 0.52)


def _scatter(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_P, SHIFT)
    hand.key(Qt.Key.Key_M, CTRL)
    size_of_brush(hand, 34)
    type_number(hand, ToolPanel, "spacing", "5 mm")
    sweep(hand, *NECK)
    hand.rest()


def _length(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_L)
    size_of_brush(hand, 50)
    type_number(hand, ToolPanel, "strength", "1")
    sweep(hand, *NECK[::-1])
    hand.rest()


def _comb(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_C)
    size_of_brush(hand, 80)
    for x, y in NECK[:4]:
        sweep(hand, (x, y - 0.02), (x - 0.03, y + 0.04), (x - 0.05, y + 0.12))
    hand.rest()


def _cut(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_K)
    size_of_brush(hand, 24)
    sweep(hand, (0.035, 0.22), (0.04, 0.36), (0.09, 0.50))
    hand.rest()


def _clone(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_D)
    switch(hand, ToolPanel, "lock")
    size_of_brush(hand, 30)
    sweep(hand, LOCK, LOCK)
    sweep(hand, RUMP, RUMP)
    hand.rest()


def _spray(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_V)
    size_of_brush(hand, 60)
    sweep(hand, NECK[3], NECK[4], NECK[3])
    hand.rest()


def _undo(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_C)
    sweep(hand, (0.55, 0.50), (0.62, 0.44), (0.68, 0.30))
    hand.key(Qt.Key.Key_Z, CTRL)
    hand.rest()


def _coat(hand: Hand, folder: Path) -> None:
    type_number(hand, CoatPanel, "clump", "0.65")
    type_number(hand, CoatPanel, "frizz", "0.12")


def _save(hand: Hand, folder: Path) -> None:
    hand.key(Qt.Key.Key_S, CTRL)
    type_file(hand, folder / "first.filo")


def _playblast(hand: Hand, folder: Path) -> None:
    palette = find_command(hand, "playblast")
    QTest.keyClick(palette.line, Qt.Key.Key_Return)
    hand.until(lambda: any(isinstance(w, PlayblastDialog) for w in QApplication.topLevelWidgets()))
    dialog = next(w for w in QApplication.topLevelWidgets() if isinstance(w, PlayblastDialog))
    for box, value in ((dialog.last, 1004), (dialog.width_box, 320), (dialog.height_box, 240)):
        box.setFocus()
        box.selectAll()
        QTest.keyClicks(box, str(value))
    dialog.path.selectAll()
    QTest.keyClicks(dialog.path, str(folder / "first.mp4"))
    QTest.mouseClick(dialog.start, Qt.MouseButton.LeftButton, NONE, dialog.start.rect().center())
    hand.rest()
    dialog.close()


STEPS: tuple[Step, ...] = (
    Step(
        "Open the demo animal",
        "Start `make run`, or `filoplume` and click the door **Open the demo**. After a few seconds the animal "
        "stands there with its coat of 100,000 hairs.",
        _open),
    Step(
        "Look around",
        "Drag with the **middle button** to turn, with **Shift** to slide; the wheel goes nearer. **Home** shows "
        "everything again. Press **3 on the number pad** to look from the animal's right side.",
        _look),
    Step(
        "Scatter guides where the mane will be",
        "**Shift+P** takes Scatter, **Ctrl+M** turns symmetry on. Press **F**, type `34`, **Return** for the size"
        " of the ring. At the right double click *Spacing* and type `5 mm`. Drag from between the ears down the "
        "neck to the back: both sides get more guides.",
        _scatter, ("Scatter",)),
    Step(
        "Grow it",
        "**L** takes Length; **F**, `50`, **Return**, and type `1` into *Strength*. Drag up the neck, from the "
        "back to the ears and against the hair: a pass makes it half as long again. With **Ctrl** it shrinks.",
        _length, ("Length",)),
    Step(
        "Comb it",
        "**C** takes Comb; **F**, `80`, **Return** for a wider ring. Four short strokes down the side of the "
        "neck, from the ears to the shoulders; symmetry combs the other side.",
        _comb, ("Comb",) * 4),
    Step(
        "Cut the tips",
        "**K** takes Cut; **F**, `24`, **Return**. Drag along the outer border of the tail: what reaches into the "
        "ring falls. Where the ring goes over a root, *Stub* says how much of the hair stays.",
        _cut, ("Cut",)),
    Step(
        "Clone a lock",
        "**D** takes Clone. Click *Whole lock* at the right; **F**, `30`, **Return**. Click on the shoulder to "
        "pick the lock under the ring, then click on the rump to stamp it there: a tuft that lies another way.",
        _clone, ("Clone",)),
    Step(
        "Hairspray",
        "**V** takes Hairspray; **F**, `60`, **Return**. Drag over the end of the mane and back: from now on it "
        "holds its shape under every tool (green guides are sprayed).",
        _spray, ("Hairspray",)),
    Step(
        "Undo",
        "**C**, and comb once against the grain: the sprayed end stays. **Ctrl+Z** takes it back. The panel "
        "*History* at the right leads to any step.",
        _undo),
    Step(
        "Numbers of the coat",
        "In the panel *Coat* double click *Clump* and type `0.65`, then *Frizz* and type `0.12`. Every bar can be"
        " dragged, too; **Shift** makes it fine, **Esc** takes it back.",
        _coat, ("Coat clump", "Coat frizz")),
    Step(
        "Save",
        "**Ctrl+S**, and a name ending in `.filo`. (**Ctrl+K**, `export coat` writes it for Blender, Houdini, Maya "
        "and Unreal.)",
        _save),
    Step(
        "Show it",
        "**Ctrl+K**, `playblast`: choose frames, size and a name ending in `.mp4`, then *Start*. The status line "
        "tells how far it is; you may go on working.",
        _playblast),
)


def chapter() -> str:
    """The steps in Markdown."""
    lines = []
    for number, step in enumerate(STEPS, 1):
        picture = f"![{step.title}](pictures/{picture_of(number)})"
        lines += [f"{number}. **{step.title}.** {step.words}", "", f"   {picture}", ""]
    return "\n".join(lines).rstrip()


def picture_of(number: int) -> str:
    """The file of a step's picture, counted from 1."""
    return f"first-{number:02}.jpg"
