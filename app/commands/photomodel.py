"""``filoplume photomodel``: cameras and a model from what was picked in photographs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from app.photomodel_file import write_model
from app.report import Report, peak_megabytes
from core.document import Document, free_id
from core.errors import UserError
from core.formats.frame_decoder import FrameDecoder
from core.formats.picks_json import photographs_of, read_picks
from core.formats.plate_file import read_plate
from core.formats.project import Project, read_project, write_project
from core.image.plate import Plate, frame_name
from core.match.photomodel.records import Photomodel
from core.match.photomodel.solve import Outcome, solved
from core.workspace import Workspace


def command(
    project: Annotated[Path, typer.Argument(help="PROJECT.filo; made when it is not there and picks are given.", show_default=False)],
    picks: Annotated[Path | None, typer.Option(help="Photographs and what was picked in them: .json; becomes a model of the project.")] = None,
    model: Annotated[str | None, typer.Option(help="Name of the model; the last one otherwise.")] = None,
    solve: Annotated[bool, typer.Option("--solve", help="Solve it and save the project.")] = False,
    again: Annotated[bool, typer.Option("--again", help="Solve it from its picks alone, not from where it is.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="What is built, as a mesh: .obj, .usda, .usdc, .ply ...")] = None,
    texture: Annotated[int, typer.Option(min=0, max=16384, help="Project the photographs onto it; texels of a side, 0 for none.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find where photographs were taken and where the points picked in them are; write what is built on those."""
    telling = Report(as_json)
    decoder = FrameDecoder()
    outcome: Outcome | None = None
    outputs: list[str] = []
    try:
        with telling.working(total=4):
            with telling.stage("read", "reading the project"):
                held = _project(project, picks)
                document = held.document
                if picks is not None:
                    document = _with_picks(document, picks, project, decoder)
                item = _chosen(document, model)
            if solve:
                with telling.stage("solve", "solving"):
                    outcome = solved(item, again=again)
                    item = outcome.model
            if solve or picks is not None:
                models = tuple(item if one.id == item.id else one for one in document.photomodels)
                document = document.replace(photomodels=models)
                with telling.stage("save", "saving the project"):
                    write_project(project, document, held.workspace)
                outputs.append(str(project))
            if output is not None:
                with telling.stage("build", "building the model"):
                    outputs += write_model(output, item, document.plates, project.parent, texture, decoder)
    finally:
        decoder.close()
    warnings = outcome.warnings if outcome else ()
    for words in warnings:
        telling.note(words)
    telling.done(_result(item, outcome, outputs, telling), [*_words(item, outcome), *outputs])


def _project(path: Path, picks: Path | None) -> Project:
    if path.suffix.lower() not in (".filo", ".filo1"):
        raise UserError(f"{path.name} is no project; its name ends in .filo.")
    if picks is not None and not path.exists():
        return Project(Document(), Workspace())
    return read_project(path)


def _with_picks(document: Document, picks: Path, project: Path, decoder: FrameDecoder) -> Document:
    """The document with the model of a file, in place of one of its name, and plates of its photographs."""
    sizes = {}
    for file in photographs_of(picks):
        height, width = decoder.decode(file)[0].shape[:2]
        sizes[file] = (width, height)
    given = read_picks(picks, sizes)
    photos = []
    for photo in given.model.photos:
        file = given.paths.get(photo.id)
        if file is not None:
            plate = read_plate(file.resolve(), decoder, plate_id=free_id(document.plates))
            frame = _frame_of(file, plate)
            plate = plate.replace(path=_beside(plate.path, project))
            same = next((one for one in document.plates if one.path == plate.path), None)
            if same is None:
                document = document.replace(plates=(*document.plates, plate))
            photo = photo.replace(plate_id=(same or plate).id, frame=frame)
        photos.append(photo)
    before = next((one for one in document.photomodels if one.name == given.model.name), None)
    item = given.model.replace(id=before.id if before else free_id(document.photomodels), photos=tuple(photos))
    others = tuple(one for one in document.photomodels if one is not before)
    return document.replace(photomodels=(*others, item))


def _beside(path: str, project: Path) -> str:
    """A path as a project names it: relative where it lies below it."""
    try:
        return Path(path).relative_to(project.resolve().parent).as_posix()
    except ValueError:
        return path


def _frame_of(file: Path, plate: Plate) -> int:
    """The number of a photograph within the plate it belongs to."""
    numbers = [n for n in range(plate.first, plate.last + 1) if n not in plate.missing]
    return next((n for n in numbers if Path(frame_name(plate.path, n)).name == file.name), plate.first)


def _chosen(document: Document, name: str | None) -> Photomodel:
    if not document.photomodels:
        raise UserError("There is no model of photographs in this project; give its picks with --picks.")
    if name is None:
        return document.photomodels[-1]
    found = [one for one in document.photomodels if one.name == name]
    if not found:
        names = ", ".join(one.name for one in document.photomodels)
        raise UserError(f"There is no model {name!r} in this project; there are {names}.")
    return found[0]


def _result(item: Photomodel, outcome: Outcome | None, outputs: list[str], telling: Report) -> dict[str, Any]:
    solved_points = {point.name: list(point.place) for point in item.points if point.place is not None}
    found: dict[str, Any] = {
        "model": item.name, "cameras": sum(photo.rotation is not None for photo in item.photos),
        "points": len(solved_points), "places": solved_points,
        "photographs": [{
            "name": photo.name, "focal_px": photo.focal_px,
            "rotation": None if photo.rotation is None else photo.rotation.tolist(), "translation": photo.translation,
        } for photo in item.photos],
        "circles": [
            {"name": one.name, "centre": one.centre, "normal": one.normal, "radius": one.radius} for one in item.circles
        ],
    }
    if outcome is not None:
        found |= {
            "observations": len(outcome.pixels), "rms_px": outcome.rms,
            "median_px": float(np.median(outcome.pixels)), "max_px": float(outcome.pixels.max()),
            "constraints": [
                {"kind": one.kind, "missed_by": float(miss)}
                for one, miss in zip(outcome.constraints, outcome.misses, strict=True)
            ],
            "warnings": list(outcome.warnings), "advice": list(outcome.advice),
        }
    return {**found, "outputs": outputs, "seconds": telling.seconds, "peak_mb": peak_megabytes()}


def _words(item: Photomodel, outcome: Outcome | None) -> list[str]:
    cameras = sum(photo.rotation is not None for photo in item.photos)
    points = sum(point.place is not None for point in item.points)
    words = f"{item.name}: {cameras} of {len(item.photos)} photographs and {points} of {len(item.points)} points have a place"
    if outcome is None:
        return [words]
    return [f"{words}: RMS {outcome.rms:.2f} px of {len(outcome.pixels)} picks", *outcome.advice]
