"""``filoplume publish FILE --to FOLDER``: the next immutable version of a project, with what others take from it."""

from __future__ import annotations

import getpass
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from app.deliver import draw
from app.feather_frames import coat_looks, export_frame
from app.report import Report
from core.document import Document, find_mesh, keys_of
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.picture import coat_meshes
from core.feather.coat.plumage import Plumage
from core.feather.pieces import FeatherMesh
from core.formats import curve_file
from core.formats.curve_file import maker
from core.formats.project import read_project
from core.formats.publish import LATEST, MANIFEST, digest, publish
from core.formats.usd_feathers import FeatherWriter
from core.groom.children import Children
from core.groom.export import groom_strands
from core.groom.grow import grow

PICTURE = (640, 400)


def command(
    file: Annotated[Path, typer.Argument(help="The project, a .filo.", show_default=False)],
    to: Annotated[Path, typer.Option("--to", help="Folder the versions are in; made when it is not there.", show_default=False)],
    note: Annotated[str, typer.Option(help="What is new in this version.")] = "",
    picture: Annotated[bool, typer.Option("--picture/--no-picture", help="Draw a small picture of the version.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Publish a project: the file, its coats as USD, a picture, and who made it when, under the next number."""
    report = Report(as_json)
    if file.suffix.lower() != ".filo":
        raise UserError(f"{file.name} is no project; save it as .filo and publish that")
    if to.exists() and not to.is_dir():
        raise UserError(f"{to} is a file; name a folder")
    document = read_project(file).document
    about = {
        "name": file.stem, "note": note, "who": getpass.getuser(), "when": datetime.now(UTC).isoformat(timespec="seconds"),
        "program": maker(), "source": {"path": str(file.resolve()), "sha256": digest(file)},
    }

    def fill(folder: Path) -> None:
        shutil.copyfile(file, folder / file.name)
        _export(document, folder, picture, report)

    with report.working(total=3), report.stage("publish", f"publishing {file.name}"):
        version = publish(to, fill, about)
    outputs = sorted(str(path) for path in version.rglob("*") if path.is_file() and path.name != MANIFEST)
    result = {"version": int(version.name[1:]), "path": str(version), "latest": str(to / LATEST),
              "seconds": report.seconds, "outputs": outputs}
    report.done(result, [f"{file.name} is version {result['version']}", str(version)])


def _export(document: Document, folder: Path, picture: bool, report: Report) -> None:
    """Coats as other programs take them, at rest, and a picture."""
    evaluator = Evaluator()
    children: dict[int, Children] = {}
    for groom in document.grooms:
        if groom.hidden or not groom.coat.count or not len(groom.guides):
            continue  # the keys of feathers grow no hair
        mesh = find_mesh(document, groom.mesh_id).mesh
        children[groom.id] = grow(groom, mesh, evaluator, frame=document.first_frame)
        path = folder / f"groom_{groom.id}.usdc"
        curve_file.write_groom(path, groom_strands(groom, mesh, children[groom.id]), mesh)
    feathers: list[FeatherMesh] = []
    for coat in document.feathers:
        if coat.hidden:
            continue
        mesh = find_mesh(document, coat.mesh_id).mesh
        laid = Plumage(evaluator).at_rest(coat, keys_of(document, coat), mesh, float(document.first_frame))
        feathers += coat_meshes(laid, coat)
        written, figures = export_frame(laid, coat, float(document.first_frame), "instances", evaluator)
        if figures["crossings"] or figures["skin_hits"]:
            report.note(f"{coat.name}: {figures['crossings']} feathers still cross, {figures['skin_hits']} reach the skin")
        writer = FeatherWriter(folder / f"feathers_{coat.id}.usdc", coat.name, mesh, maker(), coat_looks(coat), False)
        writer.write(written)
        writer.close()
    if picture and document.meshes:
        draw(folder / "picture.png", document, children, evaluator, PICTURE, feathers=tuple(feathers))
    evaluator.close()
