"""``filoplume demo``: files to look at, and the window on them where somebody sits before one."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app.commands import groom as groom_command
from app.commands import window as window_command
from app.deliver import deliver, draw, posed_document
from app.display import has_display
from app.feather_frames import feather_meshes
from app.report import Report
from core.camera import frame_points
from core.demo import demo_document
from core.demo.pose_document import pose_document, pose_workspace
from core.document import Document
from core.evaluator import Evaluator
from core.formats.project import write_project
from core.groom.grow import grow
from core.mesh.skin import Skin

POSE_FRAMES = (1001, 1017, 1045, 1065)
# frames of the bird, and where they are looked at from
BIRD_FRAMES = {1001: (-0.75, -0.2, -0.6), 1014: (-0.9, -0.35, 0.1), 1022: (-0.35, -0.5, 0.8)}


def command(
    what: Annotated[str | None, typer.Argument(help="bird for the demo of feathers, pose for that of pose space, match for that of matchmove; without a word, the groomed animal.", show_default=False)] = None,
    mesh: Annotated[Path | None, typer.Option(help="Another animal than the demo's.")] = None,
    folder: Annotated[Path, typer.Option(help="Where the files go.")] = Path("out"),
    hairs: Annotated[int, typer.Option(min=0, max=20_000_000, help="Hairs to grow.")] = 120_000,
    opened: Annotated[bool | None, typer.Option("--open/--no-open", help="Open the window on it afterwards; without either word, where a terminal and a display are there.", show_default=False)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write the demo and open it: a groomed animal (demo.filo, .usdc, .png); with pose an arm and a face (pose.filo,
    .png); with bird a finch in feathers whose wings fold (bird.filo, .png) and the same one bare, to be dressed
    (bare-bird.filo); with match a dark plate, tracked and solved: camera, head and neck (match.filo, .usda, .jpg)."""
    if what not in (None, "bird", "pose", "match"):
        raise typer.BadParameter(f"there is no demo {what}; say bird, pose, match, or nothing for the animal")
    folder.mkdir(parents=True, exist_ok=True)
    if what == "match":
        _match(folder, as_json)
    elif what == "bird":
        write_bird(folder, as_json)
    elif what == "pose":
        _pose(folder, as_json)
    else:
        _animal(folder, mesh, hairs, as_json)
    if opened or (opened is None and not as_json and sys.stdout.isatty() and has_display()):
        window_command.command(folder / f"{what or 'demo'}.filo")


def _animal(folder: Path, mesh: Path | None, hairs: int, as_json: bool) -> None:
    files = [folder / "demo.filo", folder / "demo.usdc"]
    if mesh is not None:
        groom_command.command(mesh, files, hairs=hairs, png=folder / "demo.png", as_json=as_json)
        return
    report, evaluator = Report(as_json), Evaluator()
    with report.working(total=11):
        document = demo_document(evaluator, hairs, stage=report.stage)
        groom = document.grooms[0]
        children = {groom.id: grow(groom, document.meshes[0].mesh, evaluator, stage=report.stage)}
        for path in files:
            with report.stage(f"export_{path.suffix[1:]}", f"writing {path}"):
                deliver(path, document, children)
        with report.stage("export_picture", "drawing the coat"):
            draw(folder / "demo.png", document, children, evaluator)
    outputs = [*map(str, files), str(folder / "demo.png")]
    report.done({"outputs": outputs, "seconds": report.seconds}, ["the demo animal has its coat:", *outputs])


def write_bird(folder: Path, as_json: bool) -> None:
    """The finch in its feathers, and bare, as projects; pictures of it folded, opening and open."""
    from core.demo.bird_document import bare_bird_document, bird_document

    report, evaluator = Report(as_json), Evaluator()
    bare, dressed = folder / "bare-bird.filo", folder / "bird.filo"
    pictures = [(folder / f"bird-{frame}.png", frame, view) for frame, view in BIRD_FRAMES.items()]
    with report.working(total=4 + len(pictures)):
        document = bird_document(evaluator, stage=report.stage)
        with report.stage("export_filo", f"writing {dressed}"):
            write_project(bare, bare_bird_document())
            write_project(dressed, document)
        for path, frame, view in pictures:
            with report.stage("export_picture", f"drawing {path.name}"):
                skins = posed_document(document, float(frame), evaluator)
                feathers = feather_meshes(document, skins, float(frame), evaluator)
                points = np.concatenate([skins[1].points, *(mesh.points for mesh in feathers)])
                camera = frame_points(points, view, 1.5)
                draw(path, document, {}, evaluator, (1500, 1000), skins=skins, camera=camera, feathers=feathers)
    outputs = [str(bare), str(dressed), *(str(path) for path, _, _ in pictures)]
    report.done(
        {"outputs": outputs, "seconds": report.seconds},
        ["a finch in its feathers, and the same one bare:", *outputs, f"the window opens it: filoplume {dressed}"])


def draw_poses(path: Path, document: Document, skins: Mapping[int, Skin], size: tuple[int, int] = (1600, 1000)) -> None:
    """Draw the meshes of `skins` from the front, a little from above."""
    from viewport.document_scene import scene_of
    from viewport.picture import render_png

    points = np.concatenate([skin.points for skin in skins.values()])
    camera = frame_points(points, (-0.12, -0.12, -1.0), size[0] / size[1])
    render_png(path, scene_of(document, skins, {}), camera, size)


def _pose(folder: Path, as_json: bool) -> None:
    report, evaluator = Report(as_json), Evaluator()
    project, pictures = folder / "pose.filo", [(folder / f"pose-{frame}.png", frame) for frame in POSE_FRAMES]
    with report.working(total=6):
        document = pose_document(stage=report.stage)
        with report.stage("export_filo", f"writing {project}"):
            write_project(project, document, pose_workspace(document))
        for path, frame in pictures:
            with report.stage("export_picture", f"drawing {path.name}"):
                draw_poses(path, document, posed_document(document, frame, evaluator))
    outputs = [str(project), *(str(path) for path, _ in pictures)]
    poses = [s.name for item in document.meshes if item.correctives is not None
             for layer in item.correctives.layers for s in layer.space.samples]
    report.done(
        {"poses": poses, "outputs": outputs, "seconds": report.seconds},
        [f"an arm and a face with the poses {', '.join(poses)}:", *outputs, f"the window opens them: filoplume {project}"],
    )


def _match(folder: Path, as_json: bool) -> None:
    from app.shot_demo import make_shot

    report = Report(as_json)
    with report.working(total=4):
        done, outputs = make_shot(folder, report)
    told = {
        "camera_mm": done.camera_mm, "camera_degrees": done.camera_degrees, "head_degrees": done.head_degrees,
        "neck_degrees": done.neck_degrees, "warnings": list(done.warnings), "outputs": outputs,
        "seconds": report.seconds,
    }
    report.done(told, [
        f"against what the plate was made of: the camera is {done.camera_mm:.1f} mm and {done.camera_degrees:.3f} degrees "
        f"off, the head {done.head_degrees:.3f}, the neck's joints {done.neck_degrees:.2f} degrees:", *outputs])
