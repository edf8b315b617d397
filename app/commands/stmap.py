"""``filoplume stmap``: maps that take the bend of a lens out of a plate, and put it back."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.report import Report, peak_megabytes
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.lens_file import read_lens
from core.formats.stmap_file import write_stmap
from core.match.lens import model_of
from core.match.lens_maps import canvas, redistort_map, undistort_map


def command(
    lens: Annotated[Path, typer.Argument(help="A solve (.usda), a lens (.json), or one of 3DEqualizer (.txt).", show_default=False)],
    undistort: Annotated[Path | None, typer.Option("--undistort", help="Map from the plate to the straight picture: .exr.")] = None,
    redistort: Annotated[Path | None, typer.Option("--redistort", help="Map from the straight picture to the plate: .exr.")] = None,
    overscan: Annotated[float | None, typer.Option(min=0.0, max=200.0, help="Room on every side in percent of the plate; as much as the lens needs otherwise.")] = None,
    size: Annotated[str | None, typer.Option(help="Size of the plate where the file does not say, as 1920x1080.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write 32-bit STMaps of a lens, to undistort a plate and to redistort what was made over it."""
    from app.commands.solve import plate_size

    outputs = [path for path in (undistort, redistort) if path is not None]
    if not outputs:
        raise typer.BadParameter("say what to write: --undistort MAP.exr, --redistort MAP.exr, or both")
    for path in outputs:
        if path.suffix.lower() != ".exr":
            raise UserError(f"{path.name}: maps are written as .exr")
    telling = Report(as_json)
    with telling.working(total=2):
        with telling.stage("read", "reading the lens"):
            row, plate = read_lens(lens, plate_size(size))
            room = canvas(row, plate, None if overscan is None else overscan / 100.0)
        with telling.stage("write", "writing the maps"):
            for path, make in ((undistort, undistort_map), (redistort, redistort_map)):
                if path is not None:
                    with atomic_write(path) as beside:
                        write_stmap(beside, make(row, plate, room))
    result = {
        "size": list(plate), "straight_size": list(room.size), "overscan_px": [room.left, room.top],
        "lens": model_of(row).name, "seconds": telling.seconds, "outputs": [str(path) for path in outputs],
        "warnings": [], "peak_mb": peak_megabytes(),
    }
    words = f"{plate[0]} x {plate[1]} pixels bent, {room.size[0]} x {room.size[1]} straight ({model_of(row).name})"
    telling.done(result, [words, *result["outputs"]])
