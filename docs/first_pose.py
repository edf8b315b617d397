"""The manual's first corrective by hand: what it says, and a hand that does it in the real window.

:data:`STEPS` is the one source of the chapter in pose.md, of its pictures, and of the test that follows it.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from app.window.pose.controls import PoseControls
from app.window.pose.poses import PoseList
from core.demo.pose_document import pose_document, pose_workspace
from core.formats.project import write_project
from docs.first_groom import Step
from tests.window.hand import LEFT, Hand

SIZE = (1600, 980)


def opens(hand: Hand, folder: Path) -> None:
    path = folder / "pose.filo"
    document = pose_document()
    write_project(path, document, pose_workspace(document))
    hand.window.opening.open(path)
    hand.until(lambda: bool(hand.window.desk.document.meshes), 60_000)
    hand.until(hand.window.viewport.isExposed)
    hand.rest()


def bends(hand: Hand, folder: Path) -> None:
    controls = hand.window.findChild(PoseControls)
    bar = controls.angles[2]
    bar.start_typing("80")
    QTest.keyClick(bar.line, Qt.Key.Key_Return)
    hand.rest()


def elbow_on_screen(hand: Hand) -> tuple[float, float]:
    """Where the point of the elbow is, as fractions of the view."""
    from app.window.pose.overlay import skeleton_of
    from core.overlay import Circle

    view, names = hand.window.viewport, hand.window.desk.posed.rig.skeleton.names
    rings = [m for m in skeleton_of(hand.window.desk, view.eye.camera, view.pixels(), 1.0) if isinstance(m, Circle)]
    ring = rings[names.index("elbow")]
    width, height = view.pixels()
    return ring.x / width, ring.y / height


def sculpts(hand: Hand, folder: Path) -> None:
    x, y = elbow_on_screen(hand)
    hand.drag((x, y), (x - 0.01, y + 0.045))
    hand.rest()


def goes_round_the_map(hand: Hand, folder: Path) -> None:
    canvas = hand.window.pose_side.map.canvas
    start = canvas.to_pixel(np.clip(canvas.dot, canvas.chart.low, canvas.chart.high)).toPoint() + QPoint(6, 0)
    end = canvas.to_pixel(0.55 * canvas.chart.spots[0] + 0.45 * canvas.chart.spots[1]).toPoint() + QPoint(0, -30)
    QTest.mousePress(canvas, LEFT, pos=start)
    for part in (0.25, 0.5, 0.75, 1.0):
        QTest.mouseMove(canvas, start + (end - start) * part)
        hand.painted()
    QTest.mouseRelease(canvas, LEFT, pos=end)
    hand.rest()


def narrows_the_twist(hand: Hand, folder: Path) -> None:
    poses = hand.window.findChild(PoseList)
    top = [poses.list.topLevelItem(i) for i in range(poses.list.topLevelItemCount())]
    entry = next(t.child(k) for t in top for k in range(t.childCount()) if t.child(k).text(0) == "forearm twisted")
    poses.list.clearSelection()
    poses.list.setCurrentItem(entry)
    poses.list.itemClicked.emit(entry, 0)
    poses.falloffs["wrist"].bars[0].enter(math.radians(40.0))
    hand.window.pose_side.map.layer.enter("wrist")
    hand.rest()


def walks(hand: Hand, folder: Path) -> None:
    side = hand.window.pose_side
    side.kind.enter("walk")
    side.end.enter("forearm twisted")
    hand.rest()


def colours(hand: Hand, folder: Path) -> None:
    hand.window.pose_side.look.heat.enter("strain")
    hand.rest()


def side_by_side(hand: Hand, folder: Path) -> None:
    hand.window.pose_side.look.sides.enter("SSD · SI · PSD · WPSD")
    hand.rest()


STEPS = (
    Step("Open the rig",
         "`filoplume demo pose` writes `out/pose.filo`; `filoplume out/pose.filo` opens it in the craft **Pose**. Rigs "
         "of your own (USD, glTF) open there too, by **Open** or dropped on the window; a BVH file dropped on it is "
         "played by the rig. To the right of the model lies the map of its pose space.", opens),
    Step("Bend the elbow",
         "Under **Controls** the joint *elbow* is chosen. Type `80` into **Turn Z** (or drag it): the arm bends, the "
         "dot on the map goes along. The pose is *held*; **Follow the clip** lets it go.", bends, ("Pose",)),
    Step("Sculpt",
         "With **Grab** pull the elbow out a little. At release the pose becomes a sample of the layer *elbow*, with "
         "the sculpt as its correction: it is in the list of **Poses** and on the map.", sculpts, ("Grab",)),
    Step("See it at every pose",
         "Drag the dot of the map: the model follows, with as much of each sculpt as the bright ground says. The rims "
         "show where a pose is one falloff away from a sculpt.", goes_round_the_map, ("Pose",)),
    Step("Narrow a twist",
         "Click *forearm twisted* in the list, and set **Reach wrist** to 40°. The map of the layer *wrist* shows the "
         "rim of that pose drawn in.", narrows_the_twist, ("Pose", "Falloff")),
    Step("Walk there",
         "Under **Graph** choose *walk to a pose*: it plots how fast the point moves that the sculpt moves most. Where "
         "the motion breaks, a red line says *kink*.", walks),
    Step("See what it does to the skin",
         "Set **Colours** to *strain*: where edges are longer than at rest the surface is orange, where they are "
         "shorter it is blue, and the ramp in the corner says how much. It goes along while you pose.", colours),
    Step("Compare",
         "Set **Side by side** to *SSD · SI · PSD · WPSD*: the same pose by the skin alone, by shapes, by the pose "
         "space and weighted by the skin, with one range of colours. You can pose in any of the four. Set both to "
         "*plain* and *off* to go on.", side_by_side),
)


def picture_of(number: int) -> str:
    """The file of the picture after a step."""
    return f"pose-step-{number}.jpg"


def chapter() -> str:
    """The walk-through as Markdown."""
    return "\n\n".join(
        f"**{number}. {step.title}.** {step.words}\n\n![{step.title}](pictures/{picture_of(number)})"
        for number, step in enumerate(STEPS, 1))
