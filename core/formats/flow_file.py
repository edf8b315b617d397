"""Optical flow as files: .flo (Middlebury: Baker et al. 2011) and OpenEXR (forward.u, forward.v as Nuke names them)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.flow import Flow

MAGIC = b"PIEH"
MOST_PIXELS = 1 << 27
SUFFIXES = (".flo", ".exr")


def write_flow(path: Path, flow: Flow, suffix: str) -> None:
    """Write a flow to the (temporary) path given; y points down. EXR has sigma beside it, in pixels."""
    height, width = flow.vectors.shape[:2]
    if suffix.lower() == ".flo":
        size = np.array([width, height], "<i4").tobytes()
        path.write_bytes(MAGIC + size + np.ascontiguousarray(flow.vectors, "<f4").tobytes())
        return
    import OpenImageIO as oiio

    sigma = np.sqrt(np.maximum(flow.covariance[:, :, 0] + flow.covariance[:, :, 2], 0.0) / 2.0)
    spec = oiio.ImageSpec(width, height, 3, "float")
    spec.channelnames = ("forward.u", "forward.v", "sigma.x")
    spec.attribute("compression", "zip")
    image = oiio.ImageBuf(spec)
    image.set_pixels(oiio.ROI(), np.concatenate((flow.vectors, sigma[:, :, None]), axis=2).astype(np.float32))
    if not image.write(str(path), fileformat="openexr"):
        raise UserError(f"{path.name} could not be written ({image.geterror()}).")


def read_flo(path: Path) -> NDArray[np.float32]:
    """Read a .flo file: (H, W, 2) float32.

    Raises
    ------
    UserError
        The file is no flow, cut, or too large.
    """
    data = path.read_bytes()
    if len(data) < 12 or data[:4] != MAGIC:
        raise UserError(f"{path.name} is no .flo file.")
    width, height = (int(v) for v in np.frombuffer(data, "<i4", 2, 4))
    if width < 1 or height < 1 or width * height > MOST_PIXELS or len(data) < 12 + 8 * width * height:
        raise UserError(f"{path.name} is cut or damaged.")
    return np.frombuffer(data, "<f4", 2 * width * height, 12).reshape(height, width, 2).astype(np.float32)
