"""Pictures for maps: PNG, JPEG and TIFF as arrays of float32, decoded in a bounded child process."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.sandbox import run_bounded

MOST_PIXELS = 1 << 28  # 16,384 x 16,384
LONGEST_SIDE = 1 << 17
SECONDS, MEMORY = 60.0, 8 << 30
LARGEST_FILE = 2 << 30  # bytes
MARKS = {
    b"\x89PNG\r\n\x1a\n": "PNG", b"\xff\xd8\xff": "JPEG", b"II*\0": "TIFF", b"MM\0*": "TIFF", b"II+\0": "TIFF",
    b"MM\0+": "TIFF",
}  # fmt: skip
READ_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")


def read_picture(path: str | Path, cancel: Callable[[], bool] | None = None) -> NDArray[np.float32]:
    """Read a picture as numbers, not as colours: no gamma is undone.

    Returns
    -------
    (H, W) for grey or (H, W, C) for colour, C = 3 (red, green, blue) or 4 (and alpha), float32, top row first;
    whole numbers of 8 and 16 bits become 0..1, floating ones stay as they are (what is not finite becomes 0).

    Raises
    ------
    UserError
        When the file is missing, of another format, damaged, or larger than 16,384 x 16,384 pixels.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            head = file.read(16)
        size = path.stat().st_size
    except (OSError, ValueError) as error:
        raise UserError(f"{path.name[:80]} cannot be opened ({getattr(error, 'strerror', None) or error}).") from None
    if head.startswith(b"\x76\x2f\x31\x01"):
        raise UserError(f"{path.name} is OpenEXR, which is not read for maps; convert it to TIFF (32 bits are kept).")
    if not any(head.startswith(mark) for mark in MARKS):
        raise UserError(f"{path.name} is no PNG, JPEG or TIFF picture; convert it to one of them.")
    if size > LARGEST_FILE:
        raise UserError(f"{path.name} is larger than {LARGEST_FILE >> 30} GB; make it smaller.")
    answer = run_bounded(
        "core.formats.picture:decode_in_child", {"path": str(path.resolve())}, what=path.name, seconds=SECONDS,
        memory=MEMORY, cancel=cancel,
    )  # fmt: skip
    pixels = answer["pixels"]
    if pixels.dtype.kind == "u":
        return np.multiply(pixels, np.float32(1.0 / np.iinfo(pixels.dtype).max), dtype=np.float32)
    return np.nan_to_num(pixels.astype(np.float32, copy=False), copy=False, nan=0.0, posinf=0.0, neginf=0.0)


def decode_in_child(path: str) -> dict[str, Any]:
    """The pixels of a picture in their own type, colours as red, green, blue (alpha)."""
    # OpenCV reads its limits once, when it is loaded
    os.environ["OPENCV_IO_MAX_IMAGE_PIXELS"] = str(MOST_PIXELS)
    os.environ["OPENCV_IO_MAX_IMAGE_WIDTH"] = os.environ["OPENCV_IO_MAX_IMAGE_HEIGHT"] = str(LONGEST_SIDE)
    import cv2

    name = Path(path).name
    try:
        pixels = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        if "MAX" in str(error):
            raise UserError(f"{name} has more than {MOST_PIXELS:,} pixels; make it smaller.") from None
        pixels = None
    if pixels is None:
        raise UserError(f"{name} is damaged or of a kind that is not read; export it again as PNG.")
    if pixels.dtype not in (np.uint8, np.uint16, np.float32, np.float64):
        raise UserError(f"{name} holds signed numbers; convert it to 8 or 16 bits or floating point.")
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[:, :, 0]
    if pixels.ndim == 3 and pixels.shape[2] == 2:  # grey with alpha
        pixels = pixels[:, :, 0]
    if pixels.ndim == 3:
        pixels = pixels[:, :, [2, 1, 0, 3][: pixels.shape[2]]]
    return {"pixels": np.ascontiguousarray(pixels)}


def read_colors(path: str | Path) -> NDArray[np.uint8]:
    """A picture as (H, W, 3) uint8 sRGB, top row first; grey becomes colour, what is see-through lies on white.

    Raises
    ------
    UserError
        As :func:`read_picture`.
    """
    found = np.clip(read_picture(path), 0.0, 1.0)
    if found.ndim == 2:
        found = np.repeat(found[..., None], 3, axis=2)
    if found.shape[2] == 4:
        found = found[..., :3] * found[..., 3:] + (1.0 - found[..., 3:])
    return np.asarray(np.round(255.0 * found), np.uint8)
