"""What pages of reports share: their looks, and pictures within the page."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.image.mix import to_float

STYLE = """
body{font:14px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:1180px;
padding:0 1rem;color:#1c1d20;background:#fff}
h1{font-size:1.4rem;margin:0 0 .2rem} .sub{color:#666;margin:0 0 1rem} table{border-collapse:collapse;width:100%}
th{font-weight:600;text-align:left;color:#555} td,th{padding:.35rem .6rem;
border-bottom:1px solid #e6e6e8;vertical-align:middle}
td.n{text-align:right;font-variant-numeric:tabular-nums}
img.p{width:63px;height:63px;image-rendering:pixelated;display:block}
.pics{display:flex;gap:4px} svg{display:block}
.note{background:#fff6e0;padding:.4rem .7rem;border-radius:4px;margin:.2rem 0}
img.f{width:100%;height:auto;border-radius:4px}
@media(prefers-color-scheme:dark){body{background:#1b1c1f;color:#e4e4e6}td,th{border-color:#33343a}th,.sub{color:#a0a0a6}
.note{background:#3a3220}}
"""
Read = Callable[[int], NDArray[Any] | None]


def bytes_of(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """8 bits, blue first as OpenCV writes it; floating pixels through the curve of sRGB."""
    image = to_float(pixels)
    if pixels.dtype.kind == "f":
        image = np.clip(image, 0.0, 1.0)
        image = np.where(image <= 0.0031308, 12.92 * image, 1.055 * np.maximum(image, 1e-6) ** (1 / 2.4) - 0.055)
    image = np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[:, :, 2::-1]
    return np.round(np.clip(image, 0.0, 1.0) * 255.0).astype(np.uint8)


def picture_data(image: NDArray[np.uint8], suffix: str) -> str:
    """A picture (H, W, 3) uint8, blue first, as an address that holds it; `suffix` says how it is packed."""
    _, coded = cv2.imencode(suffix, image)
    kind = "jpeg" if suffix == ".jpg" else "png"
    return f"data:image/{kind};base64,{base64.b64encode(coded.tobytes()).decode()}"
