"""Remakes every picture of the manual: ``make pictures``. The cat needs FILOPLUME_DATA."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from app.commands.demo import BIRD_FRAMES, draw_poses, write_bird
from app.deliver import draw
from app.drawing import draw_file
from core.demo.arm import arm
from core.demo.arm_sculpts import arm_sculpts
from core.demo.document import demo_document
from core.demo.pose_document import pose_document
from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.formats.mesh_file import read_mesh
from core.formats.project import write_project
from core.groom.dress import dress
from core.groom.grow import grow
from core.groom.style import load_style
from core.mesh.skin import skin_posed
from core.pose.ablation import METHODS, predicted
from core.pose.pose import REST
from core.pose.synthesis import evaluate
from tests.display import ensure_display

PICTURES = Path(__file__).parent / "pictures"
CAT = Path("meshes/odedstein_A/cat/cat-low-resolution.obj")  # Oded Stein's meshes, CC BY 4.0
PENGUIN = CAT.parents[1] / "penguin/penguin.obj"
TUM = Path("matchmove/rgbd_tum_slambook_A/ch5/rgbd/color")  # slambook (Xiang Gao, MIT), after TUM
# the chapter made of its steps stands between
FIRST_POSE = "<!-- first pose -->\n", "\n<!-- end of first pose -->"
FIRST_BIRD = "<!-- first bird -->\n", "\n<!-- end of first bird -->"
FIRST_TRACK = "<!-- first track -->\n", "\n<!-- end of first track -->"
FIRST_SOLVE = "<!-- first solve -->\n", "\n<!-- end of first solve -->"
FIRST_PHOTOMODEL = "<!-- first photomodel -->\n", "\n<!-- end of first photomodel -->"
STYLES = ("short", "fur", "long", "mane")


def shot() -> None:
    """The dark plate of the demo of matchmove beside what was solved from it."""
    from app.report import Report
    from app.shot_demo import make_shot

    with tempfile.TemporaryDirectory() as folder:
        make_shot(Path(folder), Report(True))
        image = cv2.imread(str(Path(folder) / "match.jpg"))
        cv2.imwrite(str(PICTURES / "match-shot.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 86])


def first_groom() -> None:
    """Follow the first groom by hand in the real window; a picture of the window after every step."""
    ensure_display()  # before anything of Qt is made
    from docs.first_groom import SIZE, STEPS, picture_of
    from docs.manual import written

    pictures_of_steps(STEPS, SIZE, picture_of)
    manual = PICTURES.parent / "groom.md"
    manual.write_text(written(manual.read_text("utf-8")), "utf-8")


def first_pose() -> None:
    """Follow the first corrective by hand; a picture of the window after every step."""
    ensure_display()  # before anything of Qt is made
    from docs.first_pose import SIZE, STEPS, chapter, picture_of

    pictures_of_steps(STEPS, SIZE, picture_of)
    _put_chapter("pose.md", FIRST_POSE, chapter())


def first_bird() -> None:
    """Dress the demo's bird by hand; a picture of the window after every step, and the bird at three frames."""
    ensure_display()  # before anything of Qt is made
    from docs.first_bird import SIZE, STEPS, chapter, picture_of

    pictures_of_steps(STEPS, SIZE, picture_of)
    _put_chapter("feather.md", FIRST_BIRD, chapter())
    with tempfile.TemporaryDirectory() as folder:
        write_bird(Path(folder), as_json=True)
        made = [cv2.imread(f"{folder}/bird-{frame}.png") for frame in BIRD_FRAMES]
    small = [cv2.resize(picture, (900, 600), interpolation=cv2.INTER_AREA) for picture in made]
    cv2.imwrite(str(PICTURES / "goldfinch.jpg"), cv2.hconcat(small), [cv2.IMWRITE_JPEG_QUALITY, 84])


def first_track() -> None:
    """Follow the first tracks by hand; a picture of the window after every step."""
    ensure_display()  # before anything of Qt is made
    from docs.first_track import SIZE, STEPS, chapter, picture_of

    pictures_of_steps(STEPS, SIZE, picture_of)
    _put_chapter("match.md", FIRST_TRACK, chapter())


def first_solve() -> None:
    """Follow the first solve by hand; a picture of the window after every step."""
    ensure_display()  # before anything of Qt is made
    from docs.first_solve import SIZE, STEPS, chapter, picture_of

    pictures_of_steps(STEPS, SIZE, picture_of)
    _put_chapter("match.md", FIRST_SOLVE, chapter())


def first_photomodel() -> None:
    """Follow the first model of photographs by hand; a picture of the window after every step."""
    ensure_display()  # before anything of Qt is made
    from docs.first_photomodel import LINE_UP, SIZE, STEPS, chapter, picture_of

    pictures_of_steps(STEPS, SIZE, picture_of)
    pictures_of_steps(LINE_UP, SIZE, lambda number: "line-up.jpg")
    _put_chapter("model.md", FIRST_PHOTOMODEL, chapter())


def _put_chapter(page: str, marks: tuple[str, str], chapter: str) -> None:
    manual = PICTURES.parent / page
    before, _, rest = manual.read_text("utf-8").partition(marks[0])
    _, end, after = rest.partition(marks[1])
    if not end:
        raise SystemExit(f"{page} has no line {marks[1]}: put it after the chapter that is to be made")
    manual.write_text(before + marks[0] + chapter + marks[1] + after, "utf-8")


def pictures_of_steps(steps: Sequence[Any], size: tuple[int, int], picture_of: Callable[[int], str]) -> None:
    """Do the steps of a chapter of the manual in a window of this size; the picture after each, by its number."""
    from app.window.screenshot import window_image
    from tests.window.alone import hand_at
    from tests.window.take_pictures import reduced

    with tempfile.TemporaryDirectory() as folder:
        os.environ["FILOPLUME_STATE"] = os.environ["FILOPLUME_SETTINGS"] = folder
        hand = hand_at(None, size)
        for number, step in enumerate(steps, 1):
            step.do(hand, Path(folder))
            hand.finish()
            image = reduced(window_image(hand.window), 0.75)
            cv2.imwrite(str(PICTURES / picture_of(number)), image, [cv2.IMWRITE_JPEG_QUALITY, 82])
        hand.window.close_unasked()


def match_window(plate: Path, name: str, *panels: str) -> None:
    """A plate in the window with automatic tracks, one of those that go farthest selected, and more panels."""
    ensure_display()  # before anything of Qt is made
    from app.window.screenshot import window_image
    from tests.window.alone import hand_at
    from tests.window.take_pictures import reduced
    from tools.match_edits import select_tracks

    with tempfile.TemporaryDirectory() as folder:
        os.environ["FILOPLUME_STATE"] = os.environ["FILOPLUME_SETTINGS"] = folder
        hand = hand_at(None, (1600, 1000))
        desk = hand.window.desk
        hand.window.opening.open(plate)
        hand.until(lambda: bool(desk.document.plates), 60_000)
        hand.finish()
        hand.window.commands.run("match.features")
        hand.until(lambda: not desk.jobs.running, 240_000)
        for panel in panels:
            hand.window.toggle_panel(panel)
        frame = desk.document.first_frame + 2
        desk.set_workspace(frame=float(frame))
        seen = [t for t in desk.document.tracks if frame in t.frames and frame not in t.keys[:, 0]]
        far = max(seen, key=lambda t: float(np.abs(t.points[-1] - t.points[0]).max()))
        desk.edit("Select tracks", select_tracks, (far.id,))
        hand.finish()
        image = reduced(window_image(hand.window), 0.75)
        cv2.imwrite(str(PICTURES / name), image, [cv2.IMWRITE_JPEG_QUALITY, 82])
        hand.window.close_unasked()


def feathers() -> None:
    """Every preset of a feather, six in a row, in the order of their names."""
    from app.commands.feather import LIGHT, TOWARDS
    from core.camera import frame_points
    from core.feather.levels import feather_mesh
    from core.feather.presets import preset_names, preset_values
    from viewport.context import temporary_context
    from viewport.picture import render
    from viewport.scene import Scene

    pictures = []
    with temporary_context() as context:
        for name in preset_names():
            mesh = feather_mesh(preset_values(name), 3)
            scene = Scene(feathers=(mesh,), background=LIGHT)
            pictures.append(render(scene, frame_points(mesh.points, TOWARDS, 0.6), 240, 400, 3, ctx=context))
    while len(pictures) % 6:
        pictures.append(np.full_like(pictures[0], 168))
    sheet = np.concatenate([np.concatenate(pictures[i : i + 6], axis=1) for i in range(0, len(pictures), 6)])
    cv2.imwrite(str(PICTURES / "feathers.jpg"), sheet[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])


def feather_window(bird: Path, evaluator: Evaluator) -> None:
    """The craft of feathers in the window: a tract, and a feather that was pulled off the breast."""
    ensure_display()
    from app.window.screenshot import window_image
    from tests.window.alone import hand_at
    from tests.window.take_pictures import reduced
    from tools.feather_edits import add_feathers

    mesh = read_mesh(bird, unit="m", up="y").mesh
    document = add_feathers(Document(meshes=(MeshObject(id=1, name="penguin", mesh=mesh),)), 1, 2500, evaluator)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["FILOPLUME_STATE"] = os.environ["FILOPLUME_SETTINGS"] = folder
        hand = hand_at(document, (1600, 1000))
        run = hand.window.commands.run
        run("window.craft_feather")
        hand.finish()
        run("tool.tract")
        hand.drag((0.42, 0.38), (0.43, 0.66))
        hand.finish()
        run("tool.shaft")
        hand.drag((0.55, 0.48), (0.62, 0.40))
        hand.finish()
        hand.move((0.53, 0.58))
        hand.painted()
        image = reduced(window_image(hand.window), 0.75)
        cv2.imwrite(str(PICTURES / "feather-shaft.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 82])
        hand.window.close_unasked()


def main() -> None:
    PICTURES.mkdir(exist_ok=True)
    feathers()
    first_groom()
    first_pose()
    first_bird()
    first_solve()
    first_photomodel()
    shot()
    evaluator = Evaluator()
    document = demo_document(evaluator)
    children = {1: grow(document.grooms[0], document.meshes[0].mesh, evaluator)}
    draw(PICTURES / "demo.png", document, children, evaluator, (1200, 750))
    turned = PICTURES / "turned.filo"
    write_project(turned, document)
    draw_file(turned, PICTURES / "demo-1024.png", (1200, 750), "three-quarter", 1024, print)
    turned.unlink()
    pose_pictures(evaluator)
    ablation_picture(evaluator)
    data = os.environ.get("FILOPLUME_DATA")
    if not data:
        print("FILOPLUME_DATA is not set: the pictures of the cat stay as they are")
        return
    from docs.first_track import SINTEL

    match_window(Path(data) / SINTEL, "match-window.jpg", "dope")
    match_window(Path(data) / TUM, "match-tum.jpg")
    first_track()
    feather_window(Path(data) / PENGUIN, evaluator)
    mesh = read_mesh(Path(data) / CAT, unit="m", up="y").mesh
    made = []
    for name in STYLES:
        groom = dress(mesh, load_style(name), evaluator, 5000, 150_000)
        document = Document(meshes=(MeshObject(id=1, name="cat", mesh=mesh),), grooms=(groom,))
        path = PICTURES / ("cat.png" if name == "fur" else f"cat-{name}.png")
        draw(path, document, {1: grow(groom, mesh, evaluator)}, evaluator, (1200, 750))
        made.append(cv2.imread(str(path))[:, 190:960])
        if name != "fur":
            path.unlink()
    small = [cv2.resize(image, None, fx=0.62, fy=0.62, interpolation=cv2.INTER_AREA) for image in made]
    cv2.imwrite(str(PICTURES / "styles.png"), np.hstack(small))


def pose_pictures(evaluator: Evaluator) -> None:
    """The arm with and without its sculpts, and the face at rest and at its four expressions."""
    document = pose_document()
    limb, head = document.meshes
    rows = []
    for names, item, corrected in (
        (("elbow bent", "forearm twisted", "shoulder raised"), limb, False),
        (("elbow bent", "forearm twisted", "shoulder raised"), limb, True),
        (("rest", "joy", "calm", "sadness", "anger"), head, True),
    ):
        poses = {s.name: s.pose for layer in item.correctives.layers for s in layer.space.samples}
        correctives = item.correctives if corrected else None
        row = []
        for name in names:
            points = evaluate(item.mesh.points, item.rig, correctives, poses.get(name, REST))
            size = (500, 420) if item is limb else (300, 340)
            path = PICTURES / "one.png"
            draw_poses(path, Document(meshes=(item,)), {item.id: skin_posed(item.mesh, points, evaluator)}, size)
            row.append(cv2.imread(str(path)))
            path.unlink()
        rows.append(np.hstack(row))
    cv2.imwrite(str(PICTURES / "arm-poses.png"), np.vstack(rows[:2]))
    cv2.imwrite(str(PICTURES / "face-poses.png"), rows[2])


def ablation_picture(evaluator: Evaluator) -> None:
    """Elbow, forearm and shoulder at a pose nobody sculpted, by every method, from the sculpts on both sides of it."""
    model = arm()
    known = [sculpt for share in (0.5, 1.0) for sculpt in arm_sculpts(model, share)]
    rows = []
    for held in arm_sculpts(model, 0.75):
        row = []
        for method in (None, *METHODS):
            points = held.target if method is None else predicted(
                model.mesh.points, model.rig, known, held.pose, method)
            path = PICTURES / "one.png"
            item = MeshObject(id=1, name="arm", mesh=model.mesh, rig=model.rig)
            skin = skin_posed(model.mesh, np.asarray(points, np.float32), evaluator)
            draw_poses(path, Document(meshes=(item,)), {1: skin}, (300, 240))
            image = cv2.imread(str(path))
            path.unlink()
            words = "sculpted" if method is None else method
            cv2.putText(image, words, (10, 22), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (230, 230, 230), 1, cv2.LINE_AA)
            row.append(image)
        rows.append(np.hstack(row))
    cv2.imwrite(str(PICTURES / "ablation.jpg"), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, 85])


if __name__ == "__main__":
    main()
