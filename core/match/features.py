"""Points worth following: corners whose place a pattern can be sure of, well spread over the frame.

Shi & Tomasi 1994; spread by the strongest of every neighbourhood first (Brown, Szeliski & Winder 2005).
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from core.image.mix import mean_grey

WORST = 0.15  # pixels: the standard deviation of its place that a corner may have at most, by the noise of the frame
BLANK = 0.02  # of the range of grey: how far a blank border may be off the darkest or the lightest
SMOOTH = 1.0  # pixels of the Gauss before slopes are taken


def find_features(
    image: NDArray[np.float32],
    count: int,
    pattern: int,
    taken: NDArray[np.float64] | None = None,
    hold: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Up to `count` corners (N, 2) x, y in pixels, refined to a part of one, strongest first.

    Parameters
    ----------
    image : (H, W, C). taken : (M, 2) points to keep away from. hold : (H, W), True where nothing may be found.
    """
    height, width = image.shape[:2]
    edge = pattern // 2 + 2
    if count < 1 or min(height, width) <= 2 * edge:
        return np.zeros((0, 2))
    grey = mean_grey(image)
    allowed = ~cv2.dilate(_blank_border(grey).astype(np.uint8), np.ones((2 * edge + 1,) * 2, np.uint8)).astype(np.bool_)
    allowed[:edge] = allowed[-edge:] = False
    allowed[:, :edge] = allowed[:, -edge:] = False
    if hold is not None:
        allowed &= ~hold
    strength, fine_grey = _strength(grey, pattern)
    peaks = (strength == cv2.dilate(strength, np.ones((3, 3), np.uint8))) & allowed & (strength > WORST**-2)
    # as far apart as `count` points on a square grid would be, less where there are not so many
    spacing = max(pattern / 2.0, 0.7 * float(np.sqrt(height * width / count)))
    ys, xs = np.nonzero(peaks)
    order = np.argsort(-strength[ys, xs], kind="stable")[:20_000]
    candidates = np.stack((xs[order], ys[order]), axis=1).astype(np.float64)
    chosen: list[NDArray[np.float64]] = []
    busy = np.zeros((0, 2)) if taken is None else taken
    while len(chosen) < count and spacing >= pattern / 2.0:
        for point in candidates:
            if len(chosen) == count:
                break
            near = np.concatenate((busy, np.array(chosen).reshape(-1, 2)))
            if not len(near) or ((near - point) ** 2).sum(axis=1).min() >= spacing**2:
                chosen.append(point)
        spacing *= 0.7
    if not chosen:
        return np.zeros((0, 2))
    points = np.array(chosen)
    rough = np.ascontiguousarray(points, np.float32).reshape(-1, 1, 2)
    fine = cv2.cornerSubPix(
        fine_grey, rough.copy(), (3, 3), (-1, -1), (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 20, 0.01)
    )
    fine = fine.reshape(-1, 2).astype(np.float64)
    return np.where(np.abs(fine - points) <= 1.5, fine, points)


def _strength(grey: NDArray[np.float32], pattern: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """One over the variance in px^2 a pattern's place has in its worse direction, by slopes and noise; smoothed grey.

    Shi & Tomasi's smaller eigenvalue, of slopes summed over the pattern, in units of the frame's own noise.
    """
    smooth = np.asarray(cv2.GaussianBlur(grey, (0, 0), SMOOTH), np.float32)
    # Immerkaer 1996, "Fast noise variance estimation", by medians: structure is rare beside noise
    noise = np.median(np.abs(cv2.filter2D(grey, -1, NOISE)[::2, ::2])) / (6.0 * 0.6745)
    gx, gy = (cv2.Scharr(smooth, cv2.CV_32F, *way, scale=1.0 / 32.0) for way in ((1, 0), (0, 1)))
    # of the inner half of the pattern, so that what is seen lies in its middle; a pattern like it has four times that
    half = max(3, pattern // 2 | 1)
    xx, xy, yy = (cv2.boxFilter(part, -1, (half, half), normalize=False) for part in (gx * gx, gx * gy, gy * gy))
    least = 0.5 * (xx + yy) - np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    floor = 1e-4 * float(np.ptp(smooth)) + 1e-9  # a frame of no noise at all
    # what noise itself leaves of slopes after the Gauss: 1 / (8 pi s^4) of its variance
    own = noise**2 * half**2 / (8.0 * np.pi * SMOOTH**4)
    strength = (pattern / half) ** 2 * np.maximum(least - own, 0.0) / (noise**2 + floor**2)
    return np.asarray(strength, np.float32), smooth


def _blank_border(grey: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels of a border without a picture (H, W): all darkest or all lightest, and joined to the edge of the frame."""
    low, high = float(grey.min()), float(grey.max())
    out = np.zeros(grey.shape, np.bool_)
    for blank in (grey <= low + BLANK * (high - low), grey >= high - BLANK * (high - low)):
        _, labels = cv2.connectedComponents(blank.astype(np.uint8), connectivity=4)
        rim = np.concatenate((labels[0], labels[-1], labels[:, 0], labels[:, -1]))
        out |= blank & np.isin(labels, np.unique(rim[rim > 0]))
    return out


NOISE = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
