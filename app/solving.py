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
from core.match.solve.shot import FLIP, shot_of
from core.match.solve.solution import Options, Solution
from core.match.solve.solve import solve
from core.match.solve.things import Found, Given, find_thing, without
from core.match.solve.together import Pictures, together
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
    telling: Report, title: str, picture: Any = None, known: Sequence[Known] = (), others: Sequence[Pictures] = (),
    things: Sequence[Given] = (),
) -> Solved:
    """Solve, judge and write; `picture` reads a frame of the plate for the page, or is None; `known` holds the solve.

    others : cameras that are solved together with the plate. things : what moves by itself before it.

    Raises
    ------
    UserError
        There is no camera to be trusted, or a file could not be written; the message says why.
    """
    with telling.stage("solve", "solving"):
        observations, frames, names, views, said = together(without(tracks, things), size, others)
        solution = solve(observations, frames, len(names), size, options, telling.words, views)
        solution = hold(solution, names, known)
        found = []
        for given in things:
            telling.words(f"where {given.name} is")
            solution, thing = find_thing(solution, given, tracks)
            found.append(thing)
        told = judging.report(solution, names, said)
        if found and not any(one.kind in MEASURES for one in known):
            told = told._replace(warnings=(*told.warnings, SIZELESS))
    shot = shot_of(solution, names)._replace(things=tuple(one.thing for one in found))
    with telling.stage("write", "writing"):
        for path in outputs:
            write_shot(path, shot, {"kind": told.kind, "rms_px": told.rms_px})
        if page is not None:
            from app.solve_report import write_report

            with atomic_write(page) as beside:
                write_report(beside, solution, told, names, title, picture)
    written = [str(path) for path in (*outputs, *([page] if page is not None else []))]
    state, own = solution.state, solution.views.camera == 0
    known = solution.known & own
    focal = told.focal_px[known]
    changes = shot.zooms
    result = {
        "cameras": int(known.sum()), "points": int(solution.held.sum()), "observations": int(solution.used.sum()),
        "rms_px": told.rms_px, "median_px": told.median_px, "mean_px": told.mean_px, "p95_px": told.p95_px,
        "max_px": told.most_px, "focal_px": [float(f) for f in focal] if changes else float(focal[0]),
        "focal_sigma_px": told.focal_sigma_px, "path_sigma": told.path_sigma,
        "lens": {"model": model_of(state.lens).name, **coefficients(state.lens)},
        "keyframes": [int(solution.frames[k]) for k in solution.keys if own[k]], "kind": told.kind,
        "frames": [int(solution.frames[own][0]), int(solution.frames[own][-1])], "seconds": telling.seconds,
        "warnings": list(told.warnings), "advice": list(told.advice),
        "rejected": [names[k] for k in np.flatnonzero(~solution.held)], "outputs": written,
        "others": _others(solution, told, said), "things": [_thing(one) for one in found], "peak_mb": peak_megabytes(),
    }
    first = (
        f"{known.sum()} cameras ({told.kind}), {solution.held.sum()} points from {solution.used.sum():,} observations: "
        f"median {told.median_px:.2f} px, RMS {told.rms_px:.2f} px, focal length {focal[0]:.1f} px"
        + (f" to {focal[-1]:.1f} px" if changes else "")
        + (f" +- {told.focal_sigma_px:.1f}" if told.focal_sigma_px else "")
    )
    lines = [first]
    if not own.all():
        lines.append(f"{(solution.known & ~own).sum()} of {(~own).sum()} pictures of other cameras have a place")
    lines += [
        f"{one.thing.name}: {len(one.thing.frames)} poses, RMS {one.rms_px:.2f} px, turned to within "
        f"{np.degrees(one.turn_sigma):.3f} degrees" for one in found]
    return Solved(solution, told, names, result, [*lines, *told.advice, *written])


MEASURES = ("survey", "distance")
SIZELESS = (
    "Nothing says how large the scene is, so things that move have their own size in it; give a distance or survey "
    "points with --known, and both agree."
)


def _others(solution: Solution, told: judging.Report, said: Sequence[str]) -> list[dict[str, Any]]:
    """Pictures of other cameras: where they were taken, y up, as the files of the camera have it."""
    centres, found = solution.state.centres(), []
    for row in np.flatnonzero(solution.known & (solution.views.camera > 0)):
        matrix = np.eye(4)
        matrix[:3, :3] = FLIP @ solution.state.rotation[row].T @ FLIP
        matrix[:3, 3] = FLIP @ centres[row]
        camera = solution.views.cameras[solution.views.camera[row]]
        found.append({
            "name": said[row], "focal_px": float(told.focal_px[row]), "k1": camera.k1, "k2": camera.k2,
            "rms_px": float(told.by_frame[row]), "world_from_camera": matrix.tolist(),
        })
    return found


def _thing(found: Found) -> dict[str, Any]:
    frames = found.thing.frames
    return {
        "name": found.thing.name, "poses": len(frames), "frames": [int(frames[0]), int(frames[-1])],
        "rms_px": found.rms_px, "turn_sigma_degrees": float(np.degrees(found.turn_sigma)),
        "left_out": int((~found.moving.used).sum()),
    }
