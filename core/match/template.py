"""Templates: what a pattern looks like at its key, denoised once, as cubic B-splines that are cheap to sample.

A pattern is compared with raw pixels of other frames, so all noise of the comparison's gradients is in the template.
It is taken out by a smoothing spline whose strength is found by generalised cross-validation (Craven & Wahba 1979;
in the DCT domain: Garcia 2010, "Robust smoothing of gridded data", eqs. 13-16), one strength for all channels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn
from scipy.ndimage import spline_filter1d

MARGIN = 10  # pixels around the pattern that blur, warps and the spline's support may reach
EDGE, WITHIN = 2.5, 0.911  # standard deviations of noise, and the share of its variance that is within them
STRENGTHS = np.geomspace(1e-3, 300.0, 24)


class Templates(NamedTuple):
    """Templates of some patterns of one frame.

    coefficients : (N, S, S, C) float32, of cubic B-splines.
    keep : (N, S, S) bool, False where the frame ends or a mask holds tracks off.
    centre : (N, 2) float64, x and y of the point inside (or beside) the template.
    middle : (N, 2) float64, from the point to the middle of the pattern.
    noise : (N,) float64, variance of the noise that was taken out, per channel.
    grain : (N,) float64, the same, by the finest differences of what is no edge.
    left, rough : (N,) float64, what noise of variance 1 leaves in the template after that, and what it adds to the mean
        square of the slope along an axis.
    """

    coefficients: NDArray[np.float32]
    keep: NDArray[np.bool_]
    centre: NDArray[np.float64]
    middle: NDArray[np.float64]
    noise: NDArray[np.float64]
    grain: NDArray[np.float64]
    left: NDArray[np.float64]
    rough: NDArray[np.float64]

    def with_more(self, more: Templates) -> Templates:
        """These and then those of `more`."""
        return Templates(
            np.concatenate((self.coefficients, more.coefficients)),
            np.concatenate((self.keep, more.keep)),
            np.concatenate((self.centre, more.centre)),
            np.concatenate((self.middle, more.middle)),
            np.concatenate((self.noise, more.noise)),
            np.concatenate((self.grain, more.grain)),
            np.concatenate((self.left, more.left)),
            np.concatenate((self.rough, more.rough)),
        )


def cut_templates(
    image: NDArray[np.float32],
    points: NDArray[np.float64],
    pattern: int,
    hold: NDArray[np.bool_] | None = None,
    offsets: NDArray[np.float64] | None = None,
) -> Templates:
    """Cut the pattern around every point of a frame and take its noise out.

    Parameters
    ----------
    image : (H, W, C).
    points : (N, 2) x and y in pixels, centres at whole numbers.
    pattern : side in pixels.
    hold : (H, W), True where tracks must not look.
    offsets : (N, 2) pixels from the points to the middles of their patterns; none when left out.
    """
    offsets = np.zeros((len(points), 2)) if offsets is None else offsets
    middles = points + offsets
    reach = pattern // 2 + MARGIN
    whole = np.floor(middles + 0.5).astype(np.int64)
    steps = np.arange(-reach, reach + 1)
    rows, columns = whole[:, 1, None] + steps, whole[:, 0, None] + steps
    height, width = image.shape[:2]
    keep = ((rows >= 0) & (rows < height))[:, :, None] & ((columns >= 0) & (columns < width))[:, None, :]
    rows, columns = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    pixels = image[rows[:, :, None], columns[:, None, :]].astype(np.float64)
    if hold is not None:
        keep &= ~hold[rows[:, :, None], columns[:, None, :]]
    smooth, noise, left, rough = denoise(pixels)
    grain = np.minimum(noise, _grain(pixels))
    return Templates(spline_coefficients(smooth), keep, reach + points - whole, offsets, noise, grain, left, rough)


def denoise(pixels: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Smoothing splines of patches (N, S, S, C); `noise`, `left` and `rough` of :class:`Templates`, each (N,)."""
    size, channels = pixels.shape[1], pixels.shape[3]
    wave = 2.0 - 2.0 * np.cos(np.pi * np.arange(size) / size)
    stiff = (wave[:, None] + wave) ** 2
    spectrum = dctn(pixels, axes=(1, 2), norm="ortho")
    power = (spectrum**2).sum(axis=3)
    count = size * size
    score, rests, remains, slopes = [], [], [], []
    for strength in STRENGTHS:
        taken = strength * stiff / (1.0 + strength * stiff)
        rest = (taken**2 * power).sum(axis=(1, 2)) / (count * channels)
        share = taken.mean()  # 1 - trace / n
        score.append(rest / share**2)
        rests.append(rest / (taken**2).mean())
        remains.append(((1.0 - taken) ** 2).mean())
        slopes.append(((1.0 - taken) ** 2 * wave).mean())
    best = np.argmin(score, axis=0)
    strength = STRENGTHS[best][:, None, None, None]
    smooth = idctn(spectrum / (1.0 + strength * stiff[:, :, None]), axes=(1, 2), norm="ortho")
    noise = np.asarray(rests)[best, np.arange(len(best))]
    return smooth, noise, np.asarray(remains)[best], np.asarray(slopes)[best]


def _grain(pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Variance of the noise of patches (N, S, S, C) by their finest differences (Immerkaer 1996), edges left out."""
    along = pixels[:, 2:] - 2.0 * pixels[:, 1:-1] + pixels[:, :-2]
    fine = (along[:, :, 2:] - 2.0 * along[:, :, 1:-1] + along[:, :, :-2]).reshape(len(pixels), -1) ** 2 / 36.0
    variance = np.median(fine, axis=1) / 0.455
    for _ in range(3):  # the middle of values in whole steps jumps; the mean of what is no edge does not
        inside = fine < EDGE * EDGE * variance[:, None] + 1e-30
        variance = (fine * inside).sum(axis=1) / np.maximum(inside.sum(axis=1), 1) / WITHIN
    return np.asarray(variance)


def spline_coefficients(pixels: NDArray[np.float64]) -> NDArray[np.float32]:
    """Coefficients of the cubic B-splines through patches (N, S, S, C)."""
    once = spline_filter1d(pixels, 3, axis=1, mode="mirror")
    return np.ascontiguousarray(spline_filter1d(once, 3, axis=2, mode="mirror"), np.float32)
