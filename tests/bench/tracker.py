"""The pattern tracker beside Blender's, on plates whose truth is known (FILOPLUME_TRACK_PLATES names their folder).

The folder holds what ``make_plate.py`` of the peers makes: ``*c`` clean, ``*h`` with changing light and motion blur.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from core.errors import UserError
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import PlateFrames, read_plate
from core.image.mix import mixed
from core.image.plate import ChannelMix
from core.match.track import TrackSettings, keyed_track
from core.match.tracker import Tracking
from core.workers import Workers
from tests.bench.bench import Row
from tests.display import ensure_display

TITLE = "Pattern tracker"


def run() -> list[Row]:
    folder = os.environ.get("FILOPLUME_TRACK_PLATES")
    plates = sorted(p.parent for p in Path(folder).glob("*/truth.npy")) if folder else []
    if not plates:
        raise UserError("FILOPLUME_TRACK_PLATES names no folder of plates made by make_plate.py")
    rows, pooled, bound = [], {"c": [], "h": []}, {"c": [], "h": []}
    for plate in plates:
        kind = plate.name[-1]
        ours = _ours(plate, kind == "h")
        pooled[kind].append(ours["chi2"])
        bound[kind].append(ours["bound"])
        peer = _blender(plate, kind == "h")
        rows.append(Row(f"{plate.name}: tracks kept of {ours['tracks']}", ours["good"], "", ours["tracks"], True))
        for figure in ("median_px", "p90_px"):
            most = None if peer is None else (0.75 if kind == "c" else 0.4) * peer[figure]
            rows.append(Row(f"{plate.name}: {figure[:-3]} drift", ours[figure], "px", most))
        least = None if peer is None else 0.8 * peer["ms_per_track_frame"]
        rows.append(Row(f"{plate.name}: time of track and frame", ours["ms_per_track_frame"], "ms", least))
    rows.append(Row("click to a track over the next second, frames in memory", _click(plates[0]), "ms", 100.0))
    rows += _in_the_window(plates[0])
    for kind, values in pooled.items():
        if values:
            name = f"normalised chi-square, pooled over {len(values)} plates {kind}"
            rows.append(Row(name, float(np.mean(values)), "", 1.25))
            rows.append(Row(f"{name}, at least", float(np.mean(values)), "", 0.8, True))
            name = f"errors over what the information in the pattern allows, the middle of {len(values)} plates {kind}"
            rows.append(Row(name, float(np.median(bound[kind])), "", 1.3))
    return rows


def _click(plate: Path) -> float:
    """Milliseconds from a key to its track over the next 24 frames, which are in memory as after a look at them."""
    decoder, workers = FrameDecoder(), Workers(2)
    film = read_plate(plate / "plate.####.png", decoder)
    frames, mix = PlateFrames(film, decoder), ChannelMix()
    span = range(film.first, film.first + 25)
    for k in span:
        frames.get(k)
    point = np.load(plate / "truth.npy")[0, 0]
    times = []
    for _ in range(6):  # the first one compiles
        track = keyed_track(1, "click", np.array([[film.first, *point]]))
        start = time.perf_counter()
        tracking = Tracking(lambda k: mixed(frames.get(k), mix), span, (track,), ranges=workers.ranges)
        for step in tracking.steps():
            if step.frame == span[-1]:
                break
        times.append(1e3 * (time.perf_counter() - start))
    frames.close()
    decoder.close()
    workers.close()
    return float(np.median(times[1:]))


def _in_the_window(plate: Path) -> list[Row]:
    """From a click on the picture to the track over the next second on the screen, and from cancel to the end of it."""
    reason = ensure_display()
    if reason is not None:
        raise UserError(reason)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["FILOPLUME_STATE"] = os.environ["FILOPLUME_SETTINGS"] = folder
        from PySide6.QtTest import QTest

        from tests.window.alone import hand_at

        hand = hand_at(None, (1600, 1000))
        window, desk, tracking = hand.window, hand.window.desk, hand.window.match.tracking
        shown: list[float] = []  # when a picture with the whole track was on the screen

        def painted() -> None:
            if max((len(t) for t in tracking.tails()), default=0) >= 25:
                shown.append(time.perf_counter())

        hand.view.painted.connect(painted)
        window.opening.open(plate)
        hand.until(lambda: bool(desk.document.plates), 60_000)
        window.commands.run("tool.track_point")
        first = desk.document.first_frame
        for frame in (*range(first, first + 26), first):
            desk.set_workspace(frame=float(frame))
            hand.finish()
        clicks, cancels = [], []
        for x, y in ((0.4, 0.4), (0.5, 0.5), (0.6, 0.45), (0.45, 0.6), (0.55, 0.55), (0.35, 0.5), (0.62, 0.6)):
            QTest.qWait(300)
            shown.clear()
            start = time.perf_counter()
            hand.press((x, y))
            hand.release((x, y))
            window.commands.run("match.forward")
            hand.until(lambda: bool(shown) or not tracking.running)
            clicks.append(1e3 * (shown[0] - start) if shown else np.inf)
            if tracking.job is not None and tracking.running:
                start = time.perf_counter()
                desk.jobs.cancel(tracking.job)
                hand.until(lambda: not tracking.running)
                cancels.append(1e3 * (time.perf_counter() - start))
            hand.finish()
        window.close_unasked()
    rows = [Row("click to a track over the next second, on the screen", float(np.median(clicks[1:])), "ms", 100.0)]
    return rows + [Row("cancel of tracking, the longest", max(cancels), "ms", 200.0)] * bool(cancels)


def _ours(plate: Path, blur: bool) -> dict:
    truth = np.load(plate / "truth.npy")
    decoder, workers = FrameDecoder(), Workers(2)
    film = read_plate(plate / "plate.####.png", decoder)
    frames, mix = PlateFrames(film, decoder), ChannelMix()
    tracks = tuple(keyed_track(k + 1, f"t{k}", np.array([[film.first, *path[0]]])) for k, path in enumerate(truth))
    for _ in range(2):  # the second time kernels and pages are warm, as a peer's are
        tracking = Tracking(
            lambda k: mixed(frames.get(k), mix), film.frames, tracks, TrackSettings(blur=blur), ranges=workers.ranges
        )
        start = time.perf_counter()
        for _ in tracking.steps():
            pass
        seconds = time.perf_counter() - start
    frames.close()
    decoder.close()
    workers.close()
    made = tracking.tracks()
    paths = np.full(truth.shape, np.nan)
    chi2, squares, foretold = [], [], []
    for row, track in enumerate(made):
        at = track.frames - film.first
        paths[row, at] = track.points
        error, c = (track.points - truth[row, at])[1:], track.covariance[1:]
        det = c[:, 0] * c[:, 2] - c[:, 1] ** 2
        squares.append((error**2).sum(axis=1))
        foretold.append(c[:, 0] + c[:, 2])
        cross = 2.0 * error[:, 0] * error[:, 1] * c[:, 1]
        chi2.append((error[:, 0] ** 2 * c[:, 2] - cross + error[:, 1] ** 2 * c[:, 0]) / det / 2.0)
    # in the middle, for a track in which there is nearly nothing would weigh as much as all others
    bound = np.sqrt(np.median([np.mean(s) / np.mean(f) for s, f in zip(squares, foretold, strict=True) if len(s)]))
    error = np.linalg.norm(paths - truth, axis=2)
    last = error[:, -1]
    good = ~np.isnan(last) & (np.nanmax(error, axis=1) < 3)
    return {
        "tracks": len(truth), "good": int(good.sum()), "median_px": float(np.nanmedian(last)),
        "p90_px": float(np.nanpercentile(last, 90)), "chi2": float(np.mean(np.concatenate(chi2))),
        "bound": float(bound),
        "ms_per_track_frame": 1e3 * seconds / max(1, tracking.observations),
    }  # fmt: skip


def _blender(plate: Path, normalize: bool) -> dict | None:
    """Blender's affine keyframe tracker, by ``blender_track.py``, when FILOPLUME_PEERS names a Python."""
    peers, data = os.environ.get("FILOPLUME_PEERS"), os.environ.get("FILOPLUME_DATA")
    script = Path(data).parent / "peers" / "blender_track.py" if data else None
    if not peers or script is None or not script.is_file():
        return None
    command = [peers, str(script), str(plate), *(["--normalize"] if normalize else [])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return json.loads(lines[-1]) if lines else None
