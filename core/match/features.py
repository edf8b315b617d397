"""Points worth following: corners whose place a pattern can be sure of, well spread over the frame.

Shi & Tomasi 1994; spread by the strongest of every neighbourhood first (Brown, Szeliski & Winder 2005).
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from core.image.mix import grey_bytes

WEAKEST = 1e-4  # of the strongest corner


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
    grey = grey_bytes(image)
    strength = cv2.cornerMinEigenVal(cv2.GaussianBlur(grey, (0, 0), 1.0), max(3, pattern // 2), ksize=3)
    allowed = np.zeros((height, width), np.bool_)
    allowed[edge : height - edge, edge : width - edge] = True
    if hold is not None:
        allowed &= ~hold
    # as far apart as `count` points on a square grid would be, less where there are not so many
    spacing = max(pattern / 2.0, 0.7 * float(np.sqrt(height * width / count)))
    peaks = (
        (strength == cv2.dilate(strength, np.ones((3, 3), np.uint8))) & allowed & (strength > WEAKEST * strength.max())
    )
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
        grey, rough.copy(), (3, 3), (-1, -1), (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 20, 0.01)
    )
    fine = fine.reshape(-1, 2).astype(np.float64)
    return np.where(np.abs(fine - points) <= 1.5, fine, points)
