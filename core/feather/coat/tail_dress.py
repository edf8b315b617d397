"""Feathers for the tail of a rig: the fan of rectrices, and rows of coverts that wrap its stub above and below."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from core.feather.coat.wing import Anchor, Wing, WingRow
from core.mesh.mesh import Mesh
from core.pose.rig import Rig
from core.record import freeze
from core.transform import normalized
from core.value import constant

Array = NDArray[np.float64]

TAIL = r"tail|pygostyle"
PATCH = 48  # vertices of an anchor at most
STIFF = 0.9  # share of its joint that a vertex of an anchor needs at least, where enough have it
FEATHERS, HALF_FAN = 12, np.radians(13.0)
STEP = 0.0014  # of the arm of the wing, from a feather up to the next
# how far before the end of the stub, length, feathers, height (of the arm), and degrees to either side of the top
COVERTS = (
    (0.08, 0.36, 7, 0.004, 38.0), (0.16, 0.32, 8, 0.008, 48.0), (0.24, 0.28, 10, 0.012, 60.0),
    (0.32, 0.25, 11, 0.016, 70.0))
SLAB = 0.05  # of the arm, half of the stretch over which the stub is measured


def joint_patch(rig: Rig, joint: int, least: float) -> NDArray[np.int32]:
    """The vertices (K,) int32 of which a joint has this share at least."""
    share = np.where(rig.skin.joints == joint, rig.skin.weights, 0.0).sum(axis=1)
    return np.flatnonzero(share >= least).astype(np.int32)


def anchor_of(mesh: Mesh, rig: Rig, joint: int, near: Array) -> Anchor:
    """The stiffest vertices of a joint about a place, spread evenly among them."""
    share = np.where(rig.skin.joints == joint, rig.skin.weights, 0.0).sum(axis=1)
    rows = np.flatnonzero(share >= STIFF)
    if len(rows) < 12:
        rows = np.argsort(-share, kind="stable")[:12]
    distance = np.linalg.norm(mesh.points[rows].astype(np.float64) - near, axis=1)
    rows = rows[np.argsort(distance, kind="stable")][: 6 * PATCH]
    rows = np.sort(rows[:: max(1, len(rows) // PATCH)][:PATCH])
    return Anchor(joint=rig.skeleton.names[joint], vertices=freeze(rows.astype(np.int32)))


def dress_tail(mesh: Mesh, rig: Rig, size: float, number: int) -> Wing | None:
    """A tail at the last of the joints that are called one, or None.

    size : metres, of the arm of a wing. number : the id of the tail among the wings.
    """
    called = [joint for joint, name in enumerate(rig.skeleton.names) if re.search(TAIL, name.lower())]
    if not called:
        return None
    joint = called[-1]
    own = mesh.points[joint_patch(rig, joint, 0.6)].astype(np.float64)
    if len(own) < 4:
        return None
    start = rig.skeleton.bind[joint, :3, 3]
    tip = own[np.argmax(np.linalg.norm(own - start, axis=1))]
    back = normalized(tip - start)
    across = normalized(np.array([1.0, 0.0, 0.0]) - back * back[0])
    normal = normalized(np.cross(across, back))
    if normal[1] < 0.0:
        normal = -normal
    points = mesh.points.astype(np.float64)
    points = points[np.linalg.norm(points - tip, axis=1) < size]
    root = tip - 0.05 * size * back + 0.01 * size * normal
    line = np.stack([root + s * 0.055 * size * across for s in (-1.0, 0.0, 1.0)])
    line -= np.array([0.02, 0.0, 0.02])[:, None] * size * normal
    rows = [_row(
        0, "tail feathers", "tail", FEATHERS, line, np.tile(normal, (3, 1)), np.array([1.0, 0.9, 1.0]) * size,
        np.array([0.9, 1.0, 0.9]), 0.0, STEP * size)]
    for side, name in ((1.0, "tail coverts"), (-1.0, "under tail coverts")):
        for before, length, count, height, around in COVERTS:
            places, normals, radius = _around(points, tip, back, across, side * normal, before * size, size, around)
            ones = np.ones(len(places))
            rows.append(_row(
                len(rows), f"{name} {len(rows)}", name, count, places, normals, length * size * ones, 1.2 * ones,
                height * size - 0.01 * size, 0.5 * STEP * size, 1.0 / (radius + height * size)))
    ends = [normalized(np.cos(HALF_FAN) * back + s * np.sin(HALF_FAN) * across) for s in (-1.0, 1.0)]
    return Wing(
        id=number, name="tail", kind="tail", rows=tuple(rows), inner=0, outer=0,
        anchors=(anchor_of(mesh, rig, joint, tip),), inner_direction=as_triple(ends[0]),
        outer_direction=as_triple(ends[1]), middle=0.5)


def _around(
    points: Array, tip: Array, back: Array, across: Array, normal: Array, before: float, size: float,
    around: float,
) -> tuple[Array, Array, float]:
    """Places and normals (5, 3) over one side of the stub, measured on its points, and how far they are around."""
    wide, high = _girth(points, tip, back, across, normal, before, size)
    _, behind = _girth(points, tip, back, across, normal, before - 2.0 * SLAB * size, size)
    slope = np.clip((high - behind) / (2.0 * SLAB * size), 0.0, 0.05)  # it tapers, and the feathers with it
    angles = np.radians(np.linspace(-around, around, 5))
    sides, tops = np.sin(angles)[:, None] * across, np.cos(angles)[:, None] * normal
    places = tip - before * back + wide * sides + high * tops
    normals = sides + tops + slope * back
    return places, normals / np.linalg.norm(normals, axis=1, keepdims=True), 0.5 * (wide + high)


def _girth(
    points: Array, tip: Array, back: Array, across: Array, normal: Array, before: float, size: float
) -> tuple[float, float]:
    """Half the width of the stub, and how far it reaches towards `normal` from its middle line, at a place."""
    local = points - (tip - before * back)
    slab = local[np.abs(local @ back) < SLAB * size]
    if not len(slab):
        return 0.02 * size, 0.02 * size
    return float(np.abs(slab @ across).max()), float((slab @ normal).max())


def _row(
    number: int, name: str, part: str, count: int, places: Array, normals: Array, lengths: Array, widths: Array,
    height: float, step: float, cup: float = 0.0,
) -> WingRow:
    stations = len(places)
    return WingRow(
        id=number, name=name, part=part, count=count, anchors=freeze(np.zeros(stations, np.int32)),
        places=freeze(places.astype(np.float32)), normals=freeze(normals.astype(np.float32)),
        shares=freeze(np.linspace(0.0, 1.0, stations).astype(np.float32)), lengths=freeze(lengths.astype(np.float32)),
        widths=freeze(widths.astype(np.float32)), height=height, step=step, top=0.5, cup=cup, bend=constant(0.0),
    )


def as_triple(vector: Array) -> tuple[float, float, float]:
    """Three numbers of a record."""
    return float(vector[0]), float(vector[1]), float(vector[2])
