"""STMaps as OpenEXR: red and green say where to look, as parts of the picture from its lower left corner, in 32 bits
(half floats are too coarse: 0.5 px at 2K)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError


def write_stmap(path: Path, places: NDArray[np.float32]) -> None:
    """Write (H, W, 2) float32, blue empty, to the (temporary) path given.

    Raises
    ------
    UserError
        The file could not be written.
    """
    import OpenImageIO as oiio

    height, width = places.shape[:2]
    spec = oiio.ImageSpec(width, height, 3, "float")
    spec.channelnames = ("R", "G", "B")
    spec.attribute("compression", "zip")
    image = oiio.ImageBuf(spec)
    image.set_pixels(oiio.ROI(), np.concatenate((places, np.zeros((height, width, 1), np.float32)), axis=2))
    if not image.write(str(path), fileformat="openexr"):
        raise UserError(f"{path.name} could not be written ({image.geterror()}).")
