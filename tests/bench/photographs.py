"""Photographs against measured truth and against COLMAP on the same matches, and how long a dragged pick takes.

FILOPLUME_DATA holds the photographs; FILOPLUME_COLMAP is a Python that has pycolmap.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from core.match.matches import matched_photographs
from core.match.photomodel.records import moved_pick
from core.match.photomodel.solve import solved
from core.match.solve.coordinates import onto
from core.match.solve.solution import Options, Solution
from core.match.solve.solve import solve
from core.match.solve.state import Observations, State
from core.match.solve.views import Camera, Views
from tests.bench.bench import Row, median_ms
from tests.core.match.photomodel.scenes import edge_errors, house
from tests.core.match.solve.shots import turn_error

TITLE = "Photographs"
SEEDS = 10


class Poses(NamedTuple):
    """rotation (N, 3, 3) camera_from_world, centre (N, 3), of photographs `rows`."""

    rows: np.ndarray
    rotation: np.ndarray
    centre: np.ndarray


def run() -> list[Row]:
    """Herz-Jesu P8 at a quarter of its size, the fox at its own; a house of twelve points."""
    rows = _model()
    folder = Path(os.environ.get("FILOPLUME_DATA", "")) / "matchmove"
    if (folder / "strecha_herzjesu_P8").is_dir():
        rows += _herzjesu(folder / "strecha_herzjesu_P8" / "Herz-Jesus-P8")
    if (folder / "ngp_fox").is_dir():
        rows += _fox(folder / "ngp_fox" / "fox")
    return rows


def _model() -> list[Row]:
    worst = max(float(np.abs(edge_errors(solved(house(seed)).model)).max()) for seed in range(SEEDS))
    model = solved(house(0)).model
    x, y = model.points[3].picks.xy[1]
    milliseconds = median_ms(lambda: solved(moved_pick(model, 4, 2, (x + 2.0, y - 1.0))), runs=15)
    return [
        Row("3 photographs, 12 picks, 0.5 px: the worst edge of ten models", 100 * worst, "%", 0.5),
        Row("a dragged pick solved again", milliseconds, "ms", 50.0),
    ]


def _herzjesu(folder: Path) -> list[Row]:
    numbers = [
        [float(word) for word in (folder / "gt_dense_cameras" / f"{k:04d}.jpg.camera").read_text().split()]
        for k in range(8)
    ]
    turns = np.array([np.reshape(n[12:21], (3, 3)).T for n in numbers])
    truth = Poses(np.arange(8), turns, np.array([n[21:24] for n in numbers]))
    pictures = [
        cv2.imread(str(folder / "images" / f"{k:04d}.jpg"), cv2.IMREAD_REDUCED_GRAYSCALE_4) for k in range(8)]
    camera = Camera((768, 512), 2759.48 / 4, centre=((1520.69 + 0.5) / 4 - 0.5, (1006.81 + 0.5) / 4 - 0.5))
    found = _solved(pictures, camera)
    rows = [Row(f"Herz-Jesu P8, {name}: {what}", value, unit) for name, poses in _both(found, camera).items()
            for what, value, unit in _against(poses, truth, 1000.0, "mm")]
    return [*rows, Row("Herz-Jesu P8: photographs found of 8", float(found.known.sum()), "", 8.0, at_least=True)]


def _fox(folder: Path) -> list[Row]:
    told = json.loads((folder / "transforms.json").read_text())
    pictures = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((folder / "images").iterdir())]
    camera = Camera(
        (1080, 1920), told["fl_x"], k1=told["k1"], k2=told["k2"], centre=(told["cx"] - 0.5, told["cy"] - 0.5))
    found = _solved(pictures, camera)
    count = len(pictures)
    rows = [Row(f"fox: photographs found of {count}", float(found.known.sum()), "", count, at_least=True)]
    poses = _both(found, camera)
    if "COLMAP" in poses:
        theirs = poses["COLMAP"]
        extent = float(np.ptp(theirs.centre, axis=0).max())
        limits = {"centres": 0.1, "rotations": 0.1}
        rows += [
            Row(f"fox, ours to COLMAP's: {what}", value, unit, limits[what])
            for what, value, unit in _against(poses["ours"], theirs, 100.0 / extent, "% of the extent")
        ]
    return rows


def _solved(pictures: list[np.ndarray], camera: Camera) -> Solution:
    seen = matched_photographs(pictures, 2500)
    rows = Observations(seen.photograph, seen.track, seen.xy, np.tile([1.0, 0.0, 1.0], (len(seen.xy), 1)))
    count = len(pictures)
    views = Views(np.ones(count, bool), np.zeros(count, np.int32), (camera,))
    return solve(rows, np.arange(count, dtype=np.int32), seen.tracks, camera.size, Options(camera.focal), views=views)


def _both(found: Solution, camera: Camera) -> dict[str, Poses]:
    """Ours, and COLMAP's where it is there, from the same matches without distortion."""
    rows = np.flatnonzero(found.known)
    poses = {"ours": Poses(rows, found.state.rotation[rows], found.state.centres()[rows])}
    python = os.environ.get("FILOPLUME_COLMAP")
    if python:
        with tempfile.TemporaryDirectory() as place:
            given, made = Path(place) / "in.npz", Path(place) / "out.npz"
            part, (width, height) = found.observations, camera.size
            middle = (camera.focal, 0.5 * (width - 1), 0.5 * (height - 1))
            np.savez(given, p=part.frame, t=part.track, xy=part.xy, size=camera.size, cam=middle)
            script = Path(__file__).parent / "peers" / "colmap_photographs.py"
            subprocess.run([python, script, given, made], check=True, capture_output=True)
            with np.load(made) as their:
                centre = -np.einsum("fji,fj->fi", their["R"], their["t"])
                poses["COLMAP"] = Poses(their["k"], their["R"], centre)
    return poses


def _against(poses: Poses, truth: Poses, scale: float, unit: str) -> list[tuple[str, float, str]]:
    """RMS of centres after the best similarity, and of rotations after the best common turn."""
    both, mine, true = np.intersect1d(poses.rows, truth.rows, return_indices=True)
    there = onto(poses.centre[mine], truth.centre[true]).points(poses.centre[mine]) - truth.centre[true]
    shift = np.zeros((len(both), 3))
    states = [State(one, shift, np.zeros((0, 3)), np.zeros(len(both)), np.zeros(6))
              for one in (poses.rotation[mine], truth.rotation[true])]
    degrees = turn_error(*states, np.ones(len(both), bool))
    return [
        ("centres", scale * float(np.sqrt((there**2).sum(axis=1).mean())), unit), ("rotations", degrees, "degrees"),
    ]
