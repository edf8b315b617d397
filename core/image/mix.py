"""From the pixels of a frame to the numbers that tracking and flow look at."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.image.plate import ChannelMix

DARKEST = 2.0**-10  # where the logarithm bends into a line


def to_float(pixels: NDArray[Any]) -> NDArray[np.float32]:
    """Whole numbers of 8 and 16 bits as 0..1, floating ones as they are; what is not finite becomes 0."""
    if pixels.dtype.kind == "u":
        return np.multiply(pixels, np.float32(1.0 / np.iinfo(pixels.dtype).max), dtype=np.float32)
    return np.nan_to_num(pixels.astype(np.float32), copy=False, nan=0.0, posinf=0.0, neginf=0.0)


def mixed(pixels: NDArray[Any], mix: ChannelMix) -> NDArray[np.float32]:
    """What a mix makes of a frame (H, W, 1 or 3): (H, W, C) float32, C-contiguous; C = 3 for rgb of a colour frame."""
    image = to_float(pixels)
    if image.ndim == 2:
        image = image[:, :, None]
    if mix.channels == "grey" and image.shape[2] >= 3:
        weights = np.array([mix.red, mix.green, mix.blue], np.float32)
        image = (image[:, :, :3] @ weights)[:, :, None]
    if mix.log:
        image = (np.sign(image) * np.log2(1.0 + np.abs(image) / DARKEST) / 10.0).astype(np.float32)
    if mix.denoise > 0.0:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), mix.denoise), np.float32)
    if mix.contrast > 0.0:
        image = image.reshape(*pixels.shape[:2], -1)
        side = (max(3, round(mix.contrast)),) * 2
        mean = cv2.blur(image, side).reshape(image.shape)
        spread = np.sqrt(np.maximum(cv2.blur(image * image, side).reshape(image.shape) - mean * mean, 0.0))
        image = ((image - mean) / (4.0 * spread + 0.02) + 0.5).astype(np.float32)
    return np.ascontiguousarray(image.reshape(*pixels.shape[:2], -1), np.float32)


def even_grey(first: NDArray[np.float32], second: NDArray[np.float32]) -> tuple[NDArray[np.float32], ...]:
    """Two images (H, W, C) as greys (H, W) on one scale, from 0 at the darkest to 1 at the lightest hundredth."""
    greys = [mean_grey(image) for image in (first, second)]
    low, high = np.percentile(np.stack([grey[::4, ::4] for grey in greys]), (0.5, 99.5))
    scale = np.float32(1.0 / max(float(high - low), 1e-6))
    return tuple((grey - np.float32(low)) * scale for grey in greys)


def grey_bytes(image: NDArray[np.float32]) -> NDArray[np.uint8]:
    """An image (H, W, C) as 8-bit grey from its darkest to its lightest hundredth, for methods that want no more."""
    grey = mean_grey(image)
    low, high = np.percentile(grey[::4, ::4], (0.5, 99.5))
    return np.clip((grey - low) * (255.0 / max(float(high - low), 1e-6)), 0.0, 255.0).astype(np.uint8)


def mean_grey(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """The mean of the channels (H, W)."""
    channels = image.shape[2]
    return np.asarray(image @ np.full(channels, 1.0 / channels, np.float32))
