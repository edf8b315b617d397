"""``filoplume feathers MESH -o OUT``: a bird in, a coat of feathers out."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Annotated

import typer

from app.deliver import draw, posed_document
from app.feather_frames import (
    CURVES,
    Figures,
    Form,
    coat_looks,
    export_frame,
    form_of,
    frame_range,
    say_beyond_clips,
    worse,
)
from app.report import Report, peak_megabytes
from core.document import Document, MeshObject, with_feathers, with_groom
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.coat import PLACEMENTS
from core.feather.coat.dress import KEYS, Dressed, dress_feathers
from core.feather.coat.export import added_at_rest
from core.feather.coat.picture import coat_meshes
from core.feather.coat.plumage import Laid, Plumage
from core.formats import rig_file
from core.formats.atomic import atomic_write
from core.formats.curve_file import maker
from core.formats.mesh_file import read_mesh
from core.formats.project import read_project, write_project
from core.formats.rig_assembly import NoRig
from core.formats.usd_feathers import SUFFIXES, FeatherWriter
from core.mesh.skin import Skin

CHOICES = tuple(kind for kind in PLACEMENTS if kind not in ("hand", "field"))  # these need an artist


def command(
    mesh: Annotated[Path, typer.Argument(help="The bird: OBJ, PLY, STL, OFF, GLB/glTF, USD, Alembic, or a project (.filo).", show_default=False)],
    output: Annotated[list[Path], typer.Option("--output", "-o", help="Where the coat goes: .filo .usdc .usda .usd, or .png for a picture. May be given again.", show_default=False)],
    count: Annotated[int, typer.Option(min=0, max=2_000_000, help="Feathers, exactly.")] = 10_000,
    preset: Annotated[str, typer.Option(help="The bird the feathers are of.")] = "goldfinch",
    placement: Annotated[str, typer.Option(help=f"How feathers are set: {', '.join(CHOICES)}.")] = "rows",
    keys: Annotated[int, typer.Option(min=1, max=100_000, help="Keys laid along the body, exactly.")] = KEYS,
    overlap: Annotated[float | None, typer.Option(min=0.1, max=50.0, help="How many rows a feather covers; by default 3.7, and 5.5 on a bird with wings.", show_default=False)] = None,
    wings: Annotated[bool, typer.Option("--wings/--no-wings", help="Give a rig whose joints are called humerus, forearm and hand the feathers of wings and tail, beyond the count.")] = True,
    frames: Annotated[str | None, typer.Option(help="Frames to write, as A-B; the mesh must move.")] = None,
    each: Annotated[bool, typer.Option("--meshes", help="Write every feather's own shape instead of instances.")] = False,
    nurbs: Annotated[bool, typer.Option("--nurbs", help="Write every vane as a NURBS patch and the shafts as NURBS curves.")] = False,
    curves: Annotated[str | None, typer.Option(help=f"Write curves with widths for hair renderers: {', '.join(CURVES)} (Houdini's).")] = None,
    barbs: Annotated[int | None, typer.Option(min=1, max=2000, help="Barbs a side at most, wider by what is left out; all when not given.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the file where it does not say: m, cm, mm, in, ft.")] = None,
    up: Annotated[str | None, typer.Option(help="Up axis of the file where it does not say: y or z.")] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Of everything random; the same seed gives the same coat.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Set feathers on a bird, lay them over one another so that none passes through another, and write them."""
    report = Report(as_json)
    if placement not in CHOICES:
        raise typer.BadParameter(f"placement is one of {', '.join(CHOICES)}, not {placement!r}")
    wanted, form = frame_range(frames), form_of(each, nurbs, curves)
    _check(output)
    evaluator = Evaluator()
    with report.working(total=5 + len(output)):
        with report.stage("load", f"reading {mesh.name}"):
            document = _document(mesh, unit, up, wanted is not None, report)
            if wanted is not None:
                say_beyond_clips(document, wanted, report)
        item = document.meshes[0]
        with report.stage("keys", "laying keys along the body"):
            dressed = dress_feathers(
                item.mesh, evaluator, count, preset, placement, keys, seed, overlap, mesh_id=item.id,
                rig=item.rig if wings else None)
        plumage = Plumage(evaluator)
        with report.stage("place", "setting feathers"):
            plumage.bed(dressed.coat, dressed.keys, item.mesh)
        with report.stage("layer", "laying feathers over one another"):
            rest = plumage.at_rest(dressed.coat, dressed.keys, item.mesh, float(document.first_frame))
        found = _written(output, document, dressed, plumage, rest, wanted, form, barbs, evaluator, report)
    result = {
        "keys": len(dressed.keys.guides), **found, "seconds": report.seconds, "peak_mb": peak_megabytes(),
        "outputs": [str(path) for path in output], "preset": preset, "placement": placement, "seed": seed,
    }
    report.done(result, [
        f"{found['feathers']:,} feathers from {result['keys']:,} keys on {item.name} in "
        f"{sum(report.seconds.values()):.1f} s; {found['crossings']} crossings, {found['skin_hits']} in the skin",
        *result["outputs"],
    ])


def _check(outputs: list[Path]) -> None:
    known = (".filo", ".png", *SUFFIXES)
    for path in outputs:
        if path.suffix.lower() not in known:
            raise UserError(f"{path.name}: feathers are written as {', '.join(known)}; choose one of these suffixes")
        if not path.resolve().parent.is_dir():
            raise UserError(f"the folder {path.resolve().parent} does not exist; make it first")
        if path.is_dir():
            raise UserError(f"{path} is a folder; name a file")


def _document(path: Path, unit: str | None, up: str | None, moving: bool, report: Report) -> Document:
    """The mesh of a file, with what moves it; the first mesh of a project, without its hair and feathers."""
    if path.suffix.lower() == ".filo":
        opened = read_project(path).document
        if not opened.meshes:
            raise UserError(f"{path.name} has no mesh to grow feathers on")
        return opened.replace(meshes=opened.meshes[:1], grooms=(), feathers=())
    if path.suffix.lower() in rig_file.READ_SUFFIXES:
        with suppress(NoRig):
            return rig_file.document_of(rig_file.read_rig(path, unit=unit, up=up, say=report.note))
    source = read_mesh(path, unit=unit, up=up, say=report.note)
    return Document(meshes=(MeshObject(id=1, name=source.name, mesh=source.mesh),))


def _written(
    outputs: list[Path], document: Document, dressed: Dressed, plumage: Plumage, rest: Laid,
    wanted: tuple[int, int] | None, form: Form, barbs: int | None, evaluator: Evaluator, report: Report,
) -> Figures:
    """Write every frame to every output; the worst counts of all frames, made on what was written."""
    item = document.meshes[0]
    numbers = [document.first_frame] if wanted is None else list(range(wanted[0], wanted[1] + 1))
    figures: Figures = {}
    with ExitStack() as stack:
        writers = []
        for path in outputs:
            if path.suffix.lower() == ".filo":
                write_project(path, with_feathers(with_groom(document, dressed.keys), dressed.coat))
                continue
            if path.suffix.lower() == ".png":
                with report.stage("picture", f"drawing {path.name}"):
                    draw(path, document, {}, evaluator, feathers=coat_meshes(rest, dressed.coat))
                continue
            temporary = stack.enter_context(atomic_write(path))
            writers.append(FeatherWriter(
                temporary, dressed.coat.name, item.mesh, maker(), coat_looks(dressed.coat), wanted is not None,
                document.fps))
        start = float(document.first_frame)
        added = None if wanted is None or form != "instances" else added_at_rest(rest, evaluator.workers)
        for frame in numbers:
            with report.stage("frames", f"frame {frame}"):
                laid = rest
                if wanted is not None:
                    skin: Skin = posed_document(document, float(frame), evaluator)[item.id]
                    laid = plumage.at_frame(dressed.coat, dressed.keys, item.mesh, skin, float(frame), start)
                written, made = export_frame(laid, dressed.coat, frame, form, evaluator, added, barbs)
            figures = worse(figures, made)
            with report.stage("export", f"writing frame {frame}"):
                for writer in writers:
                    writer.write(written)
        for writer in writers:
            writer.close(*(map(float, wanted) if wanted is not None else ()))
    return figures
