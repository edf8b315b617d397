"""The manual's first solve by hand: what it says, and a hand that does it in the real window.

:data:`STEPS` is the one source of the chapter in match.md, of its pictures, and of the test that follows it. The
plate is drawn here: a table with marks, a ball that rolls by itself, and a camera held in the hand.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QPushButton

from app.shot_plate import balls, box_faces, write_picture
from app.window.match.solve_panel import SolvePanel
from core.camera import Camera, look_at, project
from core.demo.bird import demo_bird
from core.formats.mesh_file import write_mesh
from core.image.plate_view import view_points
from core.match.solved_scene import points_up
from core.record import freeze
from docs.first_groom import Step
from tests.window.hand import ALT, CTRL, LEFT, NONE, SHIFT, Hand
from viewport.context import temporary_context
from viewport.picture import render
from viewport.scene import Lights, Scene, Surface

SIZE = (1600, 980)
PLATE, FOCAL = (960, 540), 1000.0  # pixels
FIRST, FRAMES = 1001, 20
MARK, GRAIN = 0.009, 3.0  # metres; levels of 255
BOXES = (  # corners in metres, and colour
    ((-0.60, -0.04, -0.40), (0.60, 0.0, 0.40), (0.26, 0.19, 0.12)),
    ((-0.46, 0.0, -0.34), (-0.26, 0.24, -0.16), (0.10, 0.16, 0.22)),
    ((0.22, 0.0, -0.30), (0.44, 0.13, -0.12), (0.22, 0.10, 0.09)),
    ((-3.0, -1.5, -1.4), (3.0, 2.0, -1.3), (0.12, 0.12, 0.13)),
)
TABLE = [(-0.48, 0.3), (0.48, 0.3), (0.0, 0.1), (-0.45, 0.0), (0.5, 0.0), (0.05, -0.3), (-0.12, 0.32), (0.2, 0.12)]
HIGHER = [
    (-0.36, 0.24, -0.25), (-0.32, 0.12, -0.16), (-0.42, 0.06, -0.16), (0.33, 0.13, -0.2), (0.28, 0.06, -0.12),
    (0.4, 0.1, -0.12), (-0.1, 0.1, -1.3), (0.75, 0.12, -1.3), (0.2, 0.2, -1.3)]
MARKS = np.array([(x, 0.0, z) for x, z in TABLE] + HIGHER)
GROUND, ACROSS, STANDS = (3, 1, 2), (1, 2), 3  # numbers of tracks, from 1 in the order of MARKS
WIDTH = 0.96  # metres between the two of ACROSS
TALL, BIRD_AT = 0.3, (0.27, 0.0, 0.12)  # metres


def ball(row: int) -> NDArray[np.float64]:
    """Where the ball is on a frame: it rolls, slowly."""
    return np.array([-0.16 + 0.004 * row, MARK, 0.2 - 0.003 * row])


def camera(row: int) -> Camera:
    """The camera of a frame."""
    t = row / (FRAMES - 1)
    eye = (-0.3 + 0.6 * t, 0.75 + 0.03 * np.sin(5.0 * t), 1.55 - 0.1 * t)
    pose = look_at(eye, (0.01 * np.sin(9.0 * t), 0.02, -0.15))
    return Camera(world_from_camera=pose, field_of_view=float(2.0 * np.arctan2(0.5 * PLATE[1], FOCAL)))


def draw_table(folder: Path) -> None:
    """Write the frames of the plate."""
    fixed = []
    for low, high, colour in BOXES:
        points, rows = box_faces(low, high)
        across = np.cross(points[1::4] - points[::4], points[2::4] - points[::4])
        normals = np.repeat(across / np.linalg.norm(across, axis=1, keepdims=True), 4, axis=0).astype(np.float32)
        fixed.append(Surface(points, normals, rows, colour))
    with temporary_context() as context:
        for row in range(FRAMES):
            marks = balls([(place, MARK) for place in (*MARKS, ball(row))])
            scene = Scene((*fixed, marks), lights=Lights(follow_camera=False), exposure=0.8)
            picture = render(scene, camera(row), *PLATE, ctx=context)
            noise = np.random.default_rng(row).normal(0.0, GRAIN, picture.shape)
            noisy = np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)
            write_picture(folder / f"table.{FIRST + row}.png", noisy)


def pixel_of(hand: Hand, place: NDArray[np.float64]) -> QPoint:
    """The pixel of the view that shows a place of the plate."""
    x, y = view_points(hand.view.eye.camera, 1.0, place, *hand.view.pixels())[0]
    ratio = hand.view.devicePixelRatio()
    return QPoint(round(x / ratio), round(y / ratio))


def click(hand: Hand, button: QPushButton) -> None:
    """Press a button of the window."""
    QTest.mouseClick(button, LEFT, NONE, button.rect().center())


def panel_of(hand: Hand) -> SolvePanel:
    """The panel of the solve."""
    return hand.window.solve_panel


def solves(hand: Hand, step: str = "Solve camera") -> None:
    hand.until(lambda: hand.window.desk.session.history.undo_name == step, 240_000)
    hand.rest()


def opens(hand: Hand, folder: Path) -> None:
    draw_table(folder)
    hand.window.match.doors.open_plate(folder / f"table.{FIRST}.png")
    hand.until(lambda: bool(hand.window.desk.document.plates), 60_000)
    hand.until(hand.window.viewport.isExposed)
    hand.rest()


def tracks(hand: Hand, folder: Path) -> None:
    seen = project(camera(0), np.vstack([MARKS, ball(0)]), *PLATE).xy
    for place in seen:
        at = pixel_of(hand, place)
        QTest.mouseMove(hand.view, at)
        QTest.mouseClick(hand.view, LEFT, NONE, at)
        hand.painted()
    hand.window.column.ensureWidgetVisible(panel_of(hand).start)
    hand.key(Qt.Key.Key_T, CTRL | ALT)
    solves(hand, "Track both ways")


def begins(hand: Hand, folder: Path) -> None:
    bar = panel_of(hand).form.fields["focal"]
    bar.start_typing(f"{FOCAL:.0f}")
    QTest.keyClick(bar.line, Qt.Key.Key_Return)
    click(hand, panel_of(hand).start)
    solves(hand)


def mends(hand: Hand, folder: Path) -> None:
    """The track of the ball, which was left out, is looked at."""
    panel = panel_of(hand)
    hand.window.column.ensureWidgetVisible(panel.without)
    entry = next(panel.advice.item(k) for k in range(panel.advice.count())
                 if panel.advice.item(k).text().startswith(f"track_{len(MARKS) + 1:02d}"))
    panel.advice.scrollToItem(entry)
    QTest.mouseClick(panel.advice.viewport(), LEFT, NONE, panel.advice.visualItemRect(entry).center())
    hand.rest()


def looks(hand: Hand, folder: Path) -> None:
    click(hand, panel_of(hand).space)
    hand.rest()


def chooses(hand: Hand, numbers: tuple[int, ...]) -> None:
    """Click points in space, the others with Shift."""
    space, desk = hand.window.solve_space, hand.window.desk
    solved = desk.document.solves[0]
    for count, number in enumerate(numbers):
        row = solved.track_ids.tolist().index(number)
        x, y = space.places()[0][row]
        QTest.mouseClick(space, LEFT, SHIFT if count else NONE, QPoint(round(x), round(y)))
    hand.rest()


def lines_up(hand: Hand, folder: Path) -> None:
    from tools.line_up_edits import set_distance

    chooses(hand, GROUND)
    hand.window.commands.run("match.ground")
    chooses(hand, ACROSS)
    hand.window.commands.run("match.axis")
    hand.window.desk.edit("Set distance", set_distance, ACROSS, WIDTH)
    hand.window.solve_space.fit()
    hand.rest()


def stands(hand: Hand, folder: Path) -> None:
    chooses(hand, (STANDS,))
    hand.window.commands.run("match.cube")
    hand.window.desk.set_workspace(frame=float(FIRST + FRAMES - 4))
    hand.rest()


def stands_bird(hand: Hand, folder: Path) -> None:
    """A bird of the project's own is brought in, and wears feathers."""
    from app.window.feather_coats import dress_with_feathers

    desk = hand.window.desk
    mesh = demo_bird().mesh
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    points = (mesh.points - [0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])]) * (TALL / (high[1] - low[1]))
    write_mesh(folder / "bird.obj", mesh.replace(points=freeze((points + BIRD_AT).astype(np.float32))))
    hand.window.opening.import_mesh(folder / "bird.obj")
    hand.until(lambda: bool(desk.document.meshes), 60_000)
    hand.rest()
    dress_with_feathers(desk, desk.document.meshes[-1], "goldfinch")
    hand.until(lambda: bool(desk.document.feathers), 240_000)
    hand.window.desk.set_craft("match")
    desk.set_workspace(frame=float(FIRST + FRAMES // 2))
    hand.finish()


def gives(hand: Hand, folder: Path) -> None:
    doors = hand.window.match.doors
    for give, name in ((doors.export_camera, "table.usda"), (doors.write_check_movie, "table.mp4"),
                       (doors.export_lens_maps, "table.exr")):
        give(folder / name)
        hand.rest()


def off_the_plane(hand: Hand) -> NDArray[np.float64]:
    """Heights in metres of the marks of the table in the solved world."""
    solved = hand.window.desk.document.solves[0]
    rows = [solved.track_ids.tolist().index(number) for number in range(1, len(TABLE) + 1)]
    return np.asarray(points_up(solved)[rows, 1])


STEPS = (
    Step("Open the plate",
         "A table, filmed by a camera in the hand. File, Open plate, any of its frames.", opens, ("Open plate",)),
    Step("Track what stands still",
         "With **Track point** click the marks of the table, the boxes and the wall, near and far; Ctrl-Alt-T follows "
         "them. The last one is a ball that rolls by itself: nothing in the plate says so yet.", tracks,
         ("Track point",) * (len(MARKS) + 1) + ("Track both ways",)),
    Step("Solve the camera",
         "In the panel **Solve** type the focal length if you know it (1000 px here; at 0 it is found) and press "
         "*Solve camera*. It works in the background; Cancel ends it at once and leaves the camera as it was. The "
         "panel says whether the camera holds, how large the errors are, and on which frames; crosses in the plate "
         "are where the solve puts the points.",
         begins, ("Solve camera",)),
    Step("See what did not fit",
         "The table has the worst tracks and frames first, with their share of the error, how sure each point is, and "
         "what the rest would be without it. Below stands what to mend: the track of the ball did not fit the camera "
         "and was left out. A click selects it and goes to it; *Leave out and solve* hides it for good.", mends),
    Step("Look at it from outside",
         "*In space* shows the path, the camera of the frame with its picture, and the points by their error with "
         "ellipses of three standard deviations. Drag to turn, or use the buttons of the camera; a click on a point "
         "selects its track.", looks),
    Step("Say where the world lies",
         "Click three marks of the table, the second and third with Shift, and choose *Ground through tracks*; two "
         "of them, *X axis along tracks*; *Distance between tracks* says that they are 0.96 metres apart. The ground "
         "stands in the plate as a grid. Nothing moves in the picture: it is only said where the world lies.", lines_up,
         (*("Select tracks",) * len(GROUND), "Set ground", *("Select tracks",) * len(ACROSS), "Set axis",
          "Set distance")),
    Step("Stand a cube on the table",
         "Click a mark of the table and choose *Cube at track*. Scrub: the cube stays where it is.", stands,
         ("Select tracks", "Test cube")),
    Step("Put the bird on the table",
         "File, Import mesh brings in what is to stand there; here it is dressed with feathers (Ctrl+K). It is seen "
         "through the solved camera, bent by its lens, on every frame: *Scene over the plate* and *Half see-through "
         "scene* (Ctrl+K) hide it, and the movie has it too.", stands_bird, ("Import bird", "Dress with feathers")),
    Step("Give the camera away",
         "File, Export camera, `table.usda`; the suffix names the program. It has one camera with a sample for every "
         "frame, and the points. *Movie of the solve* writes the plate with all that stands over it, for others to "
         "judge; *Export lens maps* writes STMaps where the lens bends.", gives),
)


def picture_of(number: int) -> str:
    """The file of the picture after a step."""
    return f"solve-step-{number}.jpg"


def chapter() -> str:
    """The walk-through as Markdown."""
    return "\n\n".join(
        f"**{number}. {step.title}.** {step.words}\n\n![{step.title}](pictures/{picture_of(number)})"
        for number, step in enumerate(STEPS, 1))
