"""``filoplume solve``: from tracks to a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app.report import Report
from app.solving import check_outputs, solve_tracks
from core.errors import UserError
from core.formats.beside_file import is_photographs, read_beside, read_thing
from core.formats.frame_decoder import FrameDecoder
from core.formats.known_file import read_known
from core.formats.lens_file import read_lens
from core.formats.picks_json import photographs_of
from core.formats.track_file import read_tracks
from core.match.lens import MODELS, model_of
from core.match.solve.solution import Options

LENSES = ("none", *(model.name for model in MODELS))


def command(
    tracks: Annotated[Path, typer.Argument(help="Tracks: .json, or a file of another program.", show_default=False)],
    output: Annotated[list[Path] | None, typer.Option("-o", "--output", help="Where the camera goes, the suffix says how; more than one may be given.")] = None,
    focal_px: Annotated[float | None, typer.Option(min=1.0, max=1e7, help="The focal length in pixels, as it is.")] = None,
    free_focal: Annotated[bool, typer.Option("--free-focal", help="Find the focal length too, from --focal-px if it is given.")] = False,
    zoom: Annotated[bool, typer.Option("--zoom", help="The focal length changes over the shot.")] = False,
    lens: Annotated[str, typer.Option(help="Find the bend of the lens too: brown, fisheye, or of 3DEqualizer radial4 and anamorphic4.")] = "none",
    lens_file: Annotated[Path | None, typer.Option(help="A lens that was measured, of filoplume grid (.json), 3DEqualizer (.txt) or another solve; its focal length counts where --focal-px is not given.")] = None,
    nodal: Annotated[bool, typer.Option("--nodal", help="The camera only turns, as on a tripod.")] = False,
    readout: Annotated[float, typer.Option(min=-1.5, max=1.5, help="Rolling shutter: the part of a frame in which all rows are read, from above.")] = 0.0,
    free_readout: Annotated[bool, typer.Option("--free-readout", help="Find that part too, from --readout if it is given.")] = False,
    known: Annotated[Path | None, typer.Option(help="Hold the solve to survey points, .csv of name, x, y, z, sigma; or to constraints, .json.")] = None,
    beside: Annotated[list[Path] | None, typer.Option("--with", help="Solve it together with a witness camera or photographs: .json, see docs/match.md; may be given again.")] = None,
    things: Annotated[list[Path] | None, typer.Option("--object", help="A mesh that moves by itself, and the tracks on it: .json; may be given again.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page that says how good the solve is and what to mend: .html.")] = None,
    size: Annotated[str | None, typer.Option(help="Size of the plate where the file does not say, as 1920x1080.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find the camera, and where the tracked points are, from their tracks."""
    asked = options_of(focal_px, free_focal, zoom, nodal, lens)._replace(readout=readout, free_readout=free_readout)
    outputs = list(output or ())
    check_outputs(outputs, report)
    telling = Report(as_json)
    with telling.working(total=3):
        with telling.stage("read", "reading the tracks"):
            plate = plate_size(size)
            given = read_tracks(tracks, size=plate)
            plate = plate or given.size
            if plate is None:
                raise UserError(f"{tracks.name} does not say how large the plate is; give --size 1920x1080.")
            if lens_file is not None:
                asked = _with_lens(asked, lens_file, plate)
            held = read_known(known) if known is not None else ()
            others = [one for path in beside or () for one in read_beside(path, _sizes(path))]
            moving = [read_thing(path, plate) for path in things or ()]
        done = solve_tracks(
            given.tracks, plate, asked, outputs, report, telling, tracks.stem, known=held, others=others, things=moving)
    for words in done.told.warnings:
        telling.note(words)
    telling.done(done.result, done.lines)


def _with_lens(asked: Options, path: Path, plate: tuple[int, int]) -> Options:
    """The options with the lens of a file, which is of plates of the same shape."""
    row, size = read_lens(path, plate)
    if asked.distortion:
        raise UserError("--lens-file gives the bend of the lens and --lens finds it; say one of them.")
    if size != plate:
        raise UserError(
            f"{path.name} is of pictures of {size[0]} x {size[1]} pixels, the plate has {plate[0]} x {plate[1]}.")
    return asked._replace(focal=asked.focal or float(np.exp(row[0])), given=row, lens=model_of(row).name)


def _sizes(path: Path) -> dict[Path, tuple[int, int]]:
    """Width and height of the photographs a file names."""
    if not is_photographs(path):
        return {}
    decoder = FrameDecoder()
    try:
        shapes = {file: decoder.decode(file)[0].shape for file in photographs_of(path)}
    finally:
        decoder.close()
    return {file: (int(shape[1]), int(shape[0])) for file, shape in shapes.items()}


def options_of(focal: float | None, free_focal: bool, zoom: bool, nodal: bool, lens: str) -> Options:
    """What a solve is asked, of the options of a command; `lens` is none or a model."""
    if lens not in LENSES:
        raise typer.BadParameter(f"choose one of {', '.join(LENSES)}", param_hint="--lens")
    bent = lens != "none"
    return Options(focal, free_focal, zoom, bent, nodal, lens if bent else "brown")


def plate_size(text: str | None) -> tuple[int, int] | None:
    """Width and height of words like 1920x1080."""
    if text is None:
        return None
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise UserError("--size is two whole numbers, as 1920x1080") from None
    if min(width, height) < 1:
        raise UserError("--size needs a width and a height of 1 or more")
    return width, height
