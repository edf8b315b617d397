"""Solving a camera: seconds, and the error of the path over that of a bundle adjustment started from the truth.

With FILOPLUME_PEERS (see blender_reads) Blender solves the same tracks in the same run, its keyframes set by hand;
ours chooses its own.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from core.match.solve.bundle import POSE, Free, adjust, smooth_zoom
from core.match.solve.report import report
from core.match.solve.solution import Options, Solution
from core.match.solve.solve import solve
from core.match.solve.state import FRAME_FOCAL
from tests.bench.bench import Row
from tests.bench.blender_reads import peers_python
from tests.core.match.solve.shots import FOCAL, SIZE, Shot, path_error, shot

TITLE = "Camera from tracks, 100 frames, 0.3 px of noise"
FRAMES, SEEDS = 100, 3
SHOTS = (("orbit", 40, 0.0, 0.4), ("orbit", 200, 0.0, 1.5), ("orbit", 200, 0.2, None), ("zoom", 200, 0.0, 4.0))


def run() -> list[Row]:
    """Medians over seeds; one untimed solve first."""
    rows: list[Row] = []
    _solved(shot("orbit", 40, FRAMES), "orbit")
    for motion, tracks, outliers, limit in SHOTS:
        seconds, ratios, theirs = [], [], []
        for seed in range(SEEDS):
            made = shot(motion, tracks, FRAMES, outliers, seed)
            start = time.perf_counter()
            found = _solved(made, motion)
            report(found, [str(k) for k in range(tracks)])
            seconds.append(time.perf_counter() - start)
            best = _best(made, motion)
            ratios.append(path_error(found.state, made.truth, found.known) / path_error(best, made.truth, found.known))
            if motion == "orbit":
                theirs += _blender(made)
        name = f"{motion}, {tracks} tracks" + (f", {round(100 * outliers)} % of them wrong" if outliers else "")
        rows.append(Row(f"{name}: ours, keyframes chosen, with its report", statistics.median(seconds), "s", limit))
        bound = 1.1 if outliers else 1.01
        rows.append(Row(f"{name}: error of the path over the optimum", statistics.median(ratios), "x", bound))
        if theirs:
            rows.append(Row(f"{name}: Blender, keyframes by hand", statistics.median(theirs), "s"))
    return rows


def _solved(made: Shot, motion: str) -> Solution:
    options = Options(FOCAL, zoom=motion == "zoom")
    return solve(made.observations, made.frames, len(made.bad), SIZE, options)


def _best(made: Shot, motion: str):
    good = made.observations.take(~made.bad[made.observations.track])
    zoom = smooth_zoom(made.frames) if motion == "zoom" else None
    columns = POSE + ((FRAME_FOCAL,) if zoom is not None else ())
    return adjust(made.truth, good, Free(frame=columns, zoom=zoom)).state


def _blender(made: Shot) -> list[float]:
    """Blender's seconds; empty where it is not."""
    python = peers_python()
    folder = Path(os.environ.get("FILOPLUME_PEER_SCRIPTS", Path(__file__).parents[3] / "shared" / "peers"))
    script = folder / "blender_solve.py"
    if python is None or not script.is_file():
        return []
    uv = np.full((len(made.frames), len(made.bad), 2), np.nan)
    uv[made.observations.frame, made.observations.track] = made.observations.xy
    truth = made.truth
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "tracks.npz"
        np.savez(
            path, uv=uv, size=SIZE, focal_px=FOCAL * np.exp(truth.focal), centres=truth.centres(),
            camera_from_world=truth.rotation, points=truth.points, bad=made.bad,
        )
        done = subprocess.run([python, script, path], capture_output=True, text=True, check=True)
    return [json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))["seconds"]]
