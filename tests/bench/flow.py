"""Optical flow beside OpenCV's dense inverse search, and DeepFlow where it is there, on pairs with known motion.

DeepFlow is in opencv-contrib: FILOPLUME_OPENCV_CONTRIB names a Python that has it.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from core.errors import UserError
from core.match.flow import flow_between
from core.workers import Workers
from tests.bench.bench import Row

TITLE = "Optical flow"


def run() -> list[Row]:
    data = os.environ.get("FILOPLUME_DATA")
    if not data:
        raise UserError("FILOPLUME_DATA names no folder of real pairs")
    return [row for name, *pair in _pairs(Path(data) / "matchmove") for row in _row(name, *pair)]


def _pairs(folder: Path):  # type: ignore[no-untyped-def]
    def read(name: str) -> np.ndarray:
        return np.float32(cv2.imread(str(folder / name))[:, :, ::-1]) / 255.0

    disparity = np.load(folder / "stereo_motorcycle/motorcycle_disp.npz")["arr_0"]
    known = np.isfinite(disparity) & (disparity > 0)
    truth = np.stack((-np.where(known, disparity, 0), np.zeros_like(disparity)), axis=2)
    yield (
        "motorcycle",
        read("stereo_motorcycle/motorcycle_left.png"),
        read("stereo_motorcycle/motorcycle_right.png"),
        truth,
        known,
    )
    chairs = "flow_flyingchairs_A/FlyingChairs_examples/0000000-"
    truth = cv2.readOpticalFlow(str(folder / f"{chairs}gt.flo"))
    yield "chairs", read(f"{chairs}img0.ppm"), read(f"{chairs}img1.ppm"), truth, np.ones(truth.shape[:2], bool)
    second = read("seq_sintel_raft/demo-frames/frame_0016.png")
    height, width = second.shape[:2]
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    inner = np.zeros((height, width), bool)
    inner[30:-30, 30:-30] = True
    rng = np.random.default_rng(1)
    for most in (2, 8, 24):
        coarse = rng.normal(size=(2, 6, 10)).astype(np.float32)
        warp = np.stack([cv2.resize(part, (width, height), interpolation=cv2.INTER_CUBIC) for part in coarse], axis=2)
        warp *= most / np.linalg.norm(warp, axis=2).max()
        first = cv2.remap(
            second, x + warp[:, :, 0], y + warp[:, :, 1], cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT
        )
        yield f"smooth warp of {most} px", np.round(np.clip(first, 0, 1) * 255) / np.float32(255), second, warp, inner


def _row(name: str, first: np.ndarray, second: np.ndarray, truth: np.ndarray, known: np.ndarray) -> list[Row]:
    workers = Workers(2)
    flow, back = (flow_between(*pair, ranges=workers.ranges) for pair in ((first, second), (second, first)))
    times, theirs_times, deep_times = [], [], []
    a, b = (cv2.cvtColor(np.uint8(np.round(image * 255)), cv2.COLOR_RGB2GRAY) for image in (first, second))
    deep = None
    for _ in range(3):  # in turns, so that whatever else runs slows all alike
        start = time.perf_counter()
        flow_between(first, second, ranges=workers.ranges)
        times.append(time.perf_counter() - start)
        start = time.perf_counter()
        peer = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM).calc(a, b, None)
        theirs_times.append(time.perf_counter() - start)
        found = _deep_flow(a, b)
        if found is not None:
            deep = found[0]
            deep_times.append(found[1])
    workers.close()
    ours = np.linalg.norm(flow.vectors - truth, axis=2)[known]
    rows = []
    goal: tuple[float | None, ...] = (0.35, 2.5, 0.5) if name == "motorcycle" else (None, None, None)
    smooth = name.startswith("smooth") and deep is not None
    if smooth:
        goal = (None, float(np.linalg.norm(deep - truth, axis=2)[known].mean()), float(np.median(deep_times)) / 5.0)
    rows += [
        Row(f"{name}: median error", float(np.median(ours)), "px", goal[0]),
        Row(f"{name}: mean error", float(ours.mean()), "px", goal[1]),
        Row(f"{name}: time", float(np.median(times)), "s", goal[2]),
    ]
    for label, vectors, seconds in (("DIS medium", peer, theirs_times), ("DeepFlow", deep, deep_times)):
        if vectors is not None:
            error = np.linalg.norm(vectors - truth, axis=2)[known]
            rows += [
                Row(f"{name}: {label}'s median error", float(np.median(error)), "px"),
                Row(f"{name}: {label}'s mean error", float(error.mean()), "px"),
                Row(f"{name}: {label}'s time", float(np.median(seconds)), "s"),
            ]
    gap = np.linalg.norm(_there_and_back(flow.vectors, back.vectors), axis=2)[known]
    trace = (flow.covariance[:, :, 0] + flow.covariance[:, :, 2])[known]
    rows.append(
        Row(f"{name}: sparsification error, by the covariance", _sparsified(ours, trace), "", _sparsified(ours, gap))
    )
    return rows


def _sparsified(error: np.ndarray, sure: np.ndarray) -> float:
    """Area between the mean errors of the surest pixels by `sure` and by the error itself, over the mean error."""
    count = np.arange(1, len(error) + 1)
    by_sure, by_error = (np.cumsum(error[np.argsort(key, kind="stable")]) / count for key in (sure, error))
    return float((by_sure - by_error).mean() / error.mean())


def _there_and_back(flow: np.ndarray, back: np.ndarray) -> np.ndarray:
    height, width = flow.shape[:2]
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    place = (x + flow[:, :, 0], y + flow[:, :, 1])
    return flow + cv2.remap(back, *place, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


DEEP = """
import sys, time
import cv2, numpy as np
a, b = np.load(sys.argv[1])["ab"]
start = time.perf_counter()
flow = cv2.optflow.createOptFlow_DeepFlow().calc(a, b, None)
np.savez(sys.argv[2], flow=flow, seconds=time.perf_counter() - start)
"""


def _deep_flow(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, float] | None:
    python = os.environ.get("FILOPLUME_OPENCV_CONTRIB")
    if not python:
        return None
    with tempfile.TemporaryDirectory() as folder:
        pair, made = Path(folder) / "pair.npz", Path(folder) / "flow.npz"
        np.savez(pair, ab=np.stack((a, b)))
        subprocess.run([python, "-c", DEEP, str(pair), str(made)], check=True, timeout=120)
        with np.load(made) as found:
            return found["flow"], float(found["seconds"])
