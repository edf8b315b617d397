"""Planes through a plate: a flat piece of the scene followed as a whole, by the homography of its own texture.

Everything inside the outline is one pattern, compared with its key (:mod:`core.match.fit_kernel`); a large plane is
followed in smaller frames, as its thousands of pixels would be of no more use than some. What is not believed is
foretold and found again, as with points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.outline import curve_through
from core.match.runs import Ranges, Runs
from core.match.track import PlaneTrack, TrackSettings
from core.record import freeze
from core.workers import serial_ranges

Image = NDArray[np.float32]
Mask = NDArray[np.bool_]
LARGEST = 121  # pixels of a side of the box around the outline, in the frames that are looked at
SMALLEST = 9
SPREAD = 7.0  # variance of a corner over that of the middle, for an affine fit to evenly spread texture: 1 + 3 + 3


def plane_steps(
    plane: PlaneTrack,
    read: Callable[[int], Image | None],
    frames: range,
    *,
    settings: TrackSettings | None = None,
    ranges: Ranges = serial_ranges,
    hold: Callable[[int], Mask | None] | None = None,
) -> Iterator[PlaneTrack]:
    """Follow a plane from its key to the last of `frames`, then to the first: the plane so far, after every frame.

    read : gives the frame that tracking looks at (H, W, C) float32, or None for a missing or broken one.
    hold : gives where it must not look (H, W) True, or None.

    Raises
    ------
    UserError
        The key is none of `frames` or cannot be read, or the outline is too small.
    """
    key = plane.key_frame
    first = read(key) if key in frames else None
    if first is None:
        raise UserError(f"Plane {plane.name} has its key at frame {key}, which cannot be read; draw it on another one.")
    outline = curve_through(plane.outline) if plane.smooth else plane.outline
    low, high = outline.min(axis=0), outline.max(axis=0)
    largest = float((high - low).max())
    if largest < SMALLEST:
        raise UserError(f"Plane {plane.name} is only {largest:.0f} pixels large; draw a larger one.")
    times = max(1, int(np.ceil(largest / LARGEST)))
    side = int(np.ceil(largest / times / 2.0)) * 2 + 1
    given = settings if settings is not None else plane.settings or TrackSettings()
    model = "homography" if given.model == "auto" else given.model
    own = given.replace(pattern=max(side, 7), search=max(2, given.search // times), model=model)
    middle = (0.5 * (low + high) + 0.5) / times - 0.5
    shape = ((outline + 0.5) / times - 0.5 - middle, False)
    found: dict[int, tuple[NDArray[np.float64], float, float]] = {key: (np.eye(3), 0.0, 1.0)}
    for direction in (1, -1):
        way = [k for k in frames if (k - key) * direction > 0][::direction]
        if not way:
            continue
        runs = Runs(own, first.shape[2], ranges)
        held = hold(key) if hold is not None else None
        row = int(
            runs.begin(_smaller(first, times), middle[None], np.array([way[-1]]), _held(held, times), None, [shape])[0]
        )
        if not runs.alive[row]:
            raise UserError(f"Plane {plane.name} shows nothing to follow at frame {key}; draw it where there is more.")
        for frame in way:
            if not runs.alive[row]:
                break
            image = read(frame)
            if image is None:
                runs.miss()
                continue
            held = hold(frame) if hold is not None else None
            seen = runs.step(_smaller(image, times), _held(held, times))
            if len(seen.rows):
                c = seen.covariance[0]
                spread = 0.5 * (c[0] + c[2]) + np.hypot(0.5 * (c[0] - c[2]), c[1])
                error = times * float(np.sqrt(SPREAD * max(spread, 0.0)))
                found[frame] = (_homography(runs.warp[row], middle, times), error, float(seen.score[0]))
            yield _with(plane, found)
    yield _with(plane, found)


def _smaller(image: Image, times: int) -> Image:
    if times == 1:
        return image
    height, width = (max(1, side // times) for side in image.shape[:2])
    # cut to whole blocks, so that a small pixel is exactly so many large ones
    whole = image[: height * times, : width * times]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(small.reshape(height, width, -1), np.float32)


def _held(hold: Mask | None, times: int) -> Mask | None:
    if hold is None or times == 1:
        return hold
    height, width = (max(1, side // times) for side in hold.shape)
    blocks = hold[: height * times, : width * times].reshape(height, times, width, times)
    return np.asarray(blocks.any(axis=(1, 3)))


def _homography(warp: NDArray[np.float64], middle: NDArray[np.float64], times: int) -> NDArray[np.float64]:
    """Full pixels of the frame from full pixels of the key."""
    x, y, a, b, c, d, h0, h1 = warp
    template_from_frame = np.array([[a, b, -a * x - b * y], [c, d, -c * x - d * y], [h0, h1, 1.0 - h0 * x - h1 * y]])
    template_from_key = np.array([[1.0, 0.0, -middle[0]], [0.0, 1.0, -middle[1]], [0.0, 0.0, 1.0]])
    half = 0.5 / times - 0.5
    small_from_full = np.array([[1.0 / times, 0.0, half], [0.0, 1.0 / times, half], [0.0, 0.0, 1.0]])
    small = np.linalg.solve(template_from_frame, template_from_key)
    full = np.linalg.solve(small_from_full, small @ small_from_full)
    return np.asarray(full / full[2, 2])


def _with(plane: PlaneTrack, found: dict[int, tuple[NDArray[np.float64], float, float]]) -> PlaneTrack:
    frames = sorted(found)
    return plane.replace(
        frames=freeze(np.array(frames, np.int32)),
        homographies=freeze(np.array([found[k][0] for k in frames])),
        error=freeze(np.array([found[k][1] for k in frames])),
        score=freeze(np.array([found[k][2] for k in frames])),
    )
