"""Comb: hair follows the ring across its length, slips through it along its length, and lies down with the stroke."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.errors import UserError
from core.falloff import SHAPES, Shape
from core.groom.collide import NO_FIELD, Ranges
from core.groom.comb_kernel import comb_rows
from core.groom.guides import Guides
from core.groom.region import View, editable
from core.mesh.distance_field import DistanceField
from core.record import freeze
from core.workers import serial_ranges

# What strength 1 of the two parts means in the kernel (tuned on tests/bench/comb_targets.py).
GRIP = 0.9
LAY = 2.5


def comb(
    guides: Guides,
    view: View,
    path: ArrayLike,
    radius: float,
    *,
    field: DistanceField | None = None,
    strength: float = 0.7,
    grip: float = 1.0,
    lay: float = 1.0,
    shape: Shape = "flat",
    flat: float = 0.15,
    tip_first: float = 0.0,
    lift: float = 0.0,
    max_bend: float = 0.75,
    clearance: float = 0.005,
    mask: NDArray[np.float32] | NDArray[np.bool_] | None = None,
    ranges: Ranges = serial_ranges,
) -> Guides:
    """Comb the guides with a ring dragged along `path`; lengths and roots are kept, the skin is not entered.

    Parameters
    ----------
    path : (K, 2) pixels, the way of the ring since the last call (two points for one dab).
    radius : of the ring, pixels.
    field : signed distance to the skin in object space; None combs without collisions.
    strength : 0 .. 1 of the whole comb.
    grip : 0 .. 1, how firmly hair follows the ring across its length.
    lay : 0 .. 2, how fast hair turns along the stroke; 0 only bends and keeps curls.
    shape : how the ring fades from its middle to its rim (core/falloff.py).
    flat : of the shape "flat": the fraction of the radius within which the ring has its full weight.
    tip_first : 0 combs the whole length, 1 mostly the tips.
    lift : radians by which laid hair stands off the skin, 0 .. 1.3.
    max_bend : radians a joint may be folded to (it is never opened by force: a sharper bend stays).
    clearance : distance kept from the skin as a fraction of the strand's length.
    mask : (G,) strength of each strand, e.g. `facing` or one side of a parting; all 1 when None.

    Returns
    -------
    Guides with new points; the same object where nothing was reached.

    Notes
    -----
    Exact in what it promises whatever the path: a path is cut into steps of at most 0.12 radii.
    """
    way = np.ascontiguousarray(np.asarray(path, np.float64).reshape(-1, 2))
    if not (np.isfinite(way).all() and math.isfinite(radius)):
        raise UserError("The comb's path and radius must be finite numbers.")
    if len(way) < 2 or radius <= 0.0 or len(guides) == 0:
        return guides
    lift = min(max(lift, 0.0), 1.3)
    reach = editable(guides).astype(np.float32) * np.float32(min(max(strength, 0.0), 1.0))
    if mask is not None:
        reach *= np.asarray(mask, np.float32)
    if not reach.any():
        return guides
    points = guides.points.copy()
    touched = np.zeros(len(guides), np.bool_)
    skin = NO_FIELD if field is None else field
    clip = np.array(view.clip_from_object, np.float64, order="C")
    basis = view.motion_basis()

    def rows(start: int, stop: int) -> None:
        comb_rows(
            start, stop, points, guides.hold, guides.roots.frames, reach, clip, basis, float(view.width),
            float(view.height), way, float(radius), GRIP * grip, LAY * lay, SHAPES.index(shape), float(flat),
            float(tip_first), float(lift), float(max_bend), skin.values, skin.origin, float(skin.cell),
            float(clearance), touched,
        )

    ranges(len(guides), rows)
    if not touched.any():
        return guides
    return guides.replace(points=freeze(points))
