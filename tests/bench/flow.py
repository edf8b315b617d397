"""Optical flow beside OpenCV's dense inverse search, on pairs with known motion."""

from __future__ import annotations

import os
import time
from pathlib import Path

import cv2
import numpy as np

from core.errors import UserError
from core.match.flow import flow_between
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
    flow_between(first, second)
    start = time.perf_counter()
    flow = flow_between(first, second)
    seconds = time.perf_counter() - start
    a, b = (cv2.cvtColor(np.uint8(np.round(image * 255)), cv2.COLOR_RGB2GRAY) for image in (first, second))
    peer = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM).calc(a, b, None)
    ours, theirs = (np.linalg.norm(v - truth, axis=2)[known] for v in (flow.vectors, peer))
    goal = (0.35, 2.5, 0.5) if name == "motorcycle" else (None, None, None)
    return [
        Row(f"{name}: median error (DIS {np.median(theirs):.3f})", float(np.median(ours)), "px", goal[0]),
        Row(f"{name}: mean error (DIS {theirs.mean():.3f})", float(ours.mean()), "px", goal[1]),
        Row(f"{name}: time", seconds, "s", goal[2]),
    ]
