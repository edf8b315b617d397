"""Frames as picture files by OpenImageIO: whole numbers of 8 or 16 bits as PNG or TIFF, floating ones as OpenEXR."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError

KINDS = {".png": ("png", "u"), ".tif": ("tiff", "u"), ".tiff": ("tiff", "u"), ".exr": ("openexr", "f")}
NAMES = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}


def frame_path(pattern: Path, frame: int) -> Path:
    """The file of a frame: "cat.####.png" gives cat.1001.png; "cat.png" the same.

    The number has as many digits as there are #, four without any; a minus stands before them.
    """
    name = pattern.name if "#" in pattern.name else f"{pattern.stem}.####{pattern.suffix}"
    start = name.index("#")
    digits = len(name[start:]) - len(name[start:].lstrip("#"))
    number = f"{'-' if frame < 0 else ''}{abs(frame):0{digits}d}"
    return pattern.with_name(name[:start] + number + name[start + digits :])


def check_frame_suffix(suffix: str, dtype: Any) -> None:
    """Raise UserError when frames of this dtype do not go into files of this suffix."""
    kind = np.dtype(dtype).kind
    if suffix.lower() not in KINDS:
        raise UserError(f"Frames are written as {', '.join(KINDS)}; {suffix or 'nothing'} is none of these suffixes.")
    if KINDS[suffix.lower()][1] != kind:
        fitting = [name for name, (_, holds) in KINDS.items() if holds == kind]
        raise UserError(f"These frames would lose what {suffix} does not hold; give a name that ends in {fitting[0]}.")


def write_frame(path: Path, pixels: NDArray[Any], suffix: str) -> None:
    """Write (H, W, C) of uint8, uint16, float16 or float32 to the (temporary) path given, top row first.

    Raises
    ------
    UserError
        The suffix is unknown or does not hold such numbers, or the file could not be written.
    """
    import OpenImageIO as oiio

    check_frame_suffix(suffix, pixels.dtype)
    height, width, channels = pixels.shape
    image = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, NAMES[pixels.dtype.name]))
    image.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels))
    if not image.write(str(path), fileformat=KINDS[suffix.lower()][0]):
        raise UserError(f"{path.name} could not be written ({image.geterror()}).")
