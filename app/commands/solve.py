"""``filoplume solve``: from tracks to a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app.report import Report, peak_megabytes
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.track_file import read_tracks

SUFFIXES = (".usda", ".usdc", ".usd")
LENSES = ("none", "brown")


def command(
    tracks: Annotated[Path, typer.Argument(help="Tracks: .json, or a file of another program.", show_default=False)],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Camera and points: .usda or .usdc.")] = None,
    focal_px: Annotated[float | None, typer.Option(min=1.0, max=1e7, help="The focal length in pixels, as it is.")] = None,
    free_focal: Annotated[bool, typer.Option("--free-focal", help="Find the focal length too, from --focal-px if it is given.")] = False,
    zoom: Annotated[bool, typer.Option("--zoom", help="The focal length changes over the shot.")] = False,
    lens: Annotated[str, typer.Option(help="none, or brown: find the bend of the lens too.")] = "none",
    nodal: Annotated[bool, typer.Option("--nodal", help="The camera only turns, as on a tripod.")] = False,
    size: Annotated[str | None, typer.Option(help="Size of the plate where the file does not say, as 1920x1080.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find the camera, and where the tracked points are, from their tracks."""
    if lens not in LENSES:
        raise typer.BadParameter(f"choose one of {', '.join(LENSES)}", param_hint="--lens")
    if output is not None and output.suffix.lower() not in SUFFIXES:
        raise UserError(f"{output.name}: a camera is written as {', '.join(SUFFIXES)}; choose one of these suffixes")
    from core.match.solve.report import report as judge
    from core.match.solve.solve import Options, observations_of, solve

    telling = Report(as_json)
    with telling.working(total=3):
        with telling.stage("read", "reading the tracks"):
            plate = _size(size)
            given = read_tracks(tracks, size=plate)
            plate = plate or given.size
            if plate is None:
                raise UserError(f"{tracks.name} does not say how large the plate is; give --size 1920x1080.")
            names = [track.name for track in given.tracks]
            observations, frames = observations_of(given.tracks)
        with telling.stage("solve", "solving"):
            options = Options(focal_px, free_focal, zoom, lens == "brown", nodal)
            solution = solve(observations, frames, len(names), plate, options, telling.words)
            found = judge(solution, names)
        with telling.stage("write", "writing"):
            if output is not None:
                from core.formats import usd_solve

                with atomic_write(output) as beside:
                    usd_solve.write(beside, solution, found, names)
    for words in found.warnings:
        telling.note(words)
    known = solution.known
    focal = found.focal_px[known]
    changes = solution.free.zoom is not None
    result = {
        "cameras": int(known.sum()), "points": int(solution.held.sum()), "observations": int(solution.used.sum()),
        "rms_px": found.rms_px, "median_px": found.median_px, "mean_px": found.mean_px, "p95_px": found.p95_px,
        "max_px": found.most_px, "focal_px": [float(f) for f in focal] if changes else float(focal[0]),
        "focal_sigma_px": found.focal_sigma_px, "path_sigma": found.path_sigma, "lens": {
            "k1": float(solution.state.lens[1]), "k2": float(solution.state.lens[2])},
        "keyframes": [int(frames[k]) for k in solution.keys], "kind": found.kind,
        "frames": [int(frames[0]), int(frames[-1])], "seconds": telling.seconds, "warnings": list(found.warnings),
        "advice": list(found.advice), "rejected": [names[k] for k in np.flatnonzero(~solution.held)],
        "outputs": [str(output)] if output is not None else [], "peak_mb": peak_megabytes(),
    }
    first = (
        f"{known.sum()} cameras ({found.kind}) and {solution.held.sum()} points from {solution.used.sum():,} observations: "
        f"median {found.median_px:.2f} px, RMS {found.rms_px:.2f} px, focal length {focal[0]:.1f} px"
        + (f" to {focal[-1]:.1f} px" if changes else "")
        + (f" +- {found.focal_sigma_px:.1f}" if found.focal_sigma_px else "")
    )
    telling.done(result, [first, *found.advice, *result["outputs"]])


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise UserError("--size is two whole numbers, as 1920x1080") from None
    if min(width, height) < 1:
        raise UserError("--size needs a width and a height of 1 or more")
    return width, height
