"""Solving as the commands do it: from tracks to a camera, its files, its page and what is told of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.report import Report, peak_megabytes
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.shot_file import check_writable, write_shot
from core.match.lens import coefficients, model_of
from core.match.solve import report as judging
from core.match.solve.held import Known, hold
from core.match.solve.shot import shot_of
from core.match.solve.solve import Options, Solution, observations_of, solve
from core.match.track import Track


class Solved(NamedTuple):
    """A solve, how good it is, the names of its tracks, and what is told of it: JSON, and lines for a person."""

    solution: Solution
    told: judging.Report
    names: list[str]
    result: dict[str, Any]
    lines: list[str]


def check_outputs(outputs: Sequence[Path], page: Path | None) -> None:
    """Refuse names of files nothing can be written as, before any work."""
    for path in outputs:
        check_writable(path)
    if page is not None and page.suffix.lower() not in (".html", ".htm"):
        raise UserError(f"{page.name}: the report is one page; name it .html")
    for path in (*outputs, *([page] if page is not None else [])):
        if not path.resolve().parent.is_dir():
            raise UserError(f"the folder {path.resolve().parent} does not exist; make it first")


def solve_tracks(
    tracks: Sequence[Track], size: tuple[int, int], options: Options, outputs: Sequence[Path], page: Path | None,
    telling: Report, title: str, picture: Any = None, known: Sequence[Known] = (),
) -> Solved:
    """Solve, judge and write; `picture` reads a frame of the plate for the page, or is None; `known` holds the solve.

    Raises
    ------
    UserError
        There is no camera to be trusted, or a file could not be written; the message says why.
    """
    names = [track.name for track in tracks]
    with telling.stage("solve", "solving"):
        observations, frames = observations_of(tracks)
        solution = hold(solve(observations, frames, len(names), size, options, telling.words), names, known)
        told = judging.report(solution, names)
    shot = shot_of(solution, names)
    with telling.stage("write", "writing"):
        for path in outputs:
            write_shot(path, shot, {"kind": told.kind, "rms_px": told.rms_px})
        if page is not None:
            from app.solve_report import write_report

            with atomic_write(page) as beside:
                write_report(beside, solution, told, names, title, picture)
    written = [str(path) for path in (*outputs, *([page] if page is not None else []))]
    known, state = solution.known, solution.state
    focal = told.focal_px[known]
    changes = solution.free.zoom is not None
    result = {
        "cameras": int(known.sum()), "points": int(solution.held.sum()), "observations": int(solution.used.sum()),
        "rms_px": told.rms_px, "median_px": told.median_px, "mean_px": told.mean_px, "p95_px": told.p95_px,
        "max_px": told.most_px, "focal_px": [float(f) for f in focal] if changes else float(focal[0]),
        "focal_sigma_px": told.focal_sigma_px, "path_sigma": told.path_sigma,
        "lens": {"model": model_of(state.lens).name, **coefficients(state.lens)},
        "keyframes": [int(solution.frames[k]) for k in solution.keys], "kind": told.kind,
        "frames": [int(solution.frames[0]), int(solution.frames[-1])], "seconds": telling.seconds,
        "warnings": list(told.warnings), "advice": list(told.advice),
        "rejected": [names[k] for k in np.flatnonzero(~solution.held)], "outputs": written,
        "peak_mb": peak_megabytes(),
    }
    first = (
        f"{known.sum()} cameras ({told.kind}), {solution.held.sum()} points from {solution.used.sum():,} observations: "
        f"median {told.median_px:.2f} px, RMS {told.rms_px:.2f} px, focal length {focal[0]:.1f} px"
        + (f" to {focal[-1]:.1f} px" if changes else "")
        + (f" +- {told.focal_sigma_px:.1f}" if told.focal_sigma_px else "")
    )
    return Solved(solution, told, names, result, [first, *told.advice, *written])
