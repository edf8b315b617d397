"""Cameras of Alembic archives. The reader runs in a bounded child process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from core.errors import UserError
from core.formats.alembic_mesh import UNIT, UP, read_properties

MOST = 10_000


def read_in_child(path: str, frame: float, fps: float) -> dict[str, Any]:
    """All cameras of the archive at the sample nearest to a frame (see ``usd_cameras.read_in_child``)."""
    from alembic3d import Abc, AbcGeom

    name = Path(path).name
    try:
        archive = Abc.IArchive(path)
    except Exception:  # its exceptions are of the C++ runtime
        raise UserError(f"{name} is not an Alembic file that can be read; export it again.") from None
    when = Abc.ISampleSelector(frame / fps)
    names: list[str] = []
    world, lens = [], []
    said: dict[str, Any] = {}
    waiting = [(archive.getTop(), np.eye(4))]  # row vectors, as the file has them
    while waiting and len(names) < MOST:
        parent, outer = waiting.pop()
        for row in reversed(range(parent.getNumChildren())):
            child = parent.getChild(row)
            header, inner = child.getHeader(), outer
            if AbcGeom.IXform.matches(header):
                schema = AbcGeom.IXform(parent, child.getName()).getSchema()
                sample = schema.getValue(when)
                local = np.array(sample.getMatrix(), np.float64).reshape(4, 4)
                inner = local @ outer if sample.getInheritsXforms() else local
                read_properties(schema.getUserProperties(), said)
            waiting.append((child, inner))
        if parent.getParent() and AbcGeom.ICamera.matches(parent.getHeader()):
            schema = AbcGeom.ICamera(parent.getParent(), parent.getName()).getSchema()
            if schema.getNumSamples():
                sample = schema.getValue(when)
                scale = 5.0 / max(sample.getFocalLength(), 1e-9)  # half an aperture in cm over a length in mm
                names.append(parent.getFullName())
                world.append(outer.T)
                lens.append((
                    0.0, sample.getHorizontalAperture() * sample.getLensSqueezeRatio() * scale,
                    sample.getVerticalAperture() * scale, sample.getNearClippingPlane(), sample.getFarClippingPlane(),
                    (abs(sample.getHorizontalFilmOffset()) + abs(sample.getVerticalFilmOffset())) * scale))
    unit, up = said.get(UNIT), said.get(UP)
    return {
        "names": names, "world": np.array(world, np.float64).reshape(-1, 4, 4),
        "lens": np.array(lens, np.float64).reshape(-1, 6),
        "metres_per_unit": unit if isinstance(unit, float) else None,
        "up": up if up in ("y", "z") else None,
    }
