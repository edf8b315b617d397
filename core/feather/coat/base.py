"""Feathers as they would lie before any of them makes way: poses from keys, values of the coat, chance and the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.feather.coat.bed import Bed
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.frames import turned, unit
from core.feather.coat.ground import curvatures, smoothed
from core.feather.coat.layering import Feathers
from core.feather.coat.posing import BEND, CUP, LENGTH, LIFT, POSE, ROLL, TWIST
from core.random import rand

BODY = 0.9  # length and width of a feather times the curvature of the body below it stay under this
YIELD = 1.0  # how readily feathers draw in where the skin strains, or bends below them by a radian
ABOVE_SKIN = 0.02  # spacings that a root stands out of the skin
FAN = np.radians(8.0), np.radians(4.0), np.radians(3.0), 0.15  # variation of yaw, lift, roll, length


class Base(NamedTuple):
    """Feathers before they settle.

    feathers : vanes, roots, frames and ranks. poses : (N, 6) float64. fields : named columns (N,) expressions read.
    """

    feathers: Feathers
    poses: NDArray[np.float64]
    fields: dict[str, Any]


class Stand(NamedTuple):
    """What N feathers stand on, at rest or in one pose of the skin.

    positions : (N, 3) float32. frames : (N, 3, 3) float32 without yaw. bend : (N, 3), see ``curved``.
    limit : (N,) factor on lengths.
    """

    positions: NDArray[np.float32]
    frames: NDArray[np.float32]
    bend: NDArray[np.float64]
    limit: NDArray[np.float64]


def lie_down(
    coat: FeatherCoat, bed: Bed, stand: Stand, numbers: Mapping[str, Any], fields: dict[str, Any],
    own: NDArray[np.float32], curves: NDArray[np.float64], rank: NDArray[np.float64], sides: NDArray[np.float64],
) -> Base:
    """The feathers of a coat on what they stand on, before they settle.

    numbers : the values of the coat, each a number or (N,). fields : what keys say. own : vanes at length 1, and
    `curves` (N, 2) what they curve by themselves. rank, sides : the growth order, and the side of the midline.
    """
    frames, bend_of, count = stand.frames, stand.bend, len(bed.places.ids)
    normals = frames[:, 2].astype(np.float64)
    ids, seed = bed.places.ids, seed_of(coat)
    spread = [coat.variation * (2.0 * rand(ids, seed + 301 + k) - 1.0) for k in range(4)]
    wind = unit(np.asarray(coat.wind_direction, np.float64)[None])[0] * np.ones((count, 1))
    behind = np.maximum(-np.einsum("nc,nc->n", wind, frames[:, 1]), 0.0) * numbers["wind"]
    aside = np.einsum("nc,nc->n", wind, frames[:, 0]) * numbers["wind"]
    yaw = numbers["yaw"] + FAN[0] * spread[0] + 0.4 * aside
    up = numbers["ruffle"] * (0.1 + 0.6 * rand(ids, seed + 311)) + 0.45 * numbers["puff"] + 0.7 * behind
    length = fields["length"] * numbers["length"] * (1.0 + FAN[3] * spread[3])
    length = np.maximum(length * stand.limit, 1e-12)
    poses = np.empty((count, POSE))
    # what the keys' lift varies by is small beside the lift itself, or feathers would lean into the skin
    poses[:, LIFT] = fields["lift"] * (1.0 + 0.4 * spread[1]) + numbers["lift"] + up
    poses[:, ROLL] = numbers["roll"] * sides + FAN[2] * spread[2] * 0.5
    poses[:, LENGTH] = length
    curl = fields["turn"] + numbers["curl"] - 0.5 * numbers["puff"] - 0.5 * up
    # what a vane is curved by itself follows a curved body as well
    across, along = (curves / length[:, None]).T
    bend = bend_of[:, 1] - np.clip(along, 0.0, np.maximum(bend_of[:, 1], 0.0)) - curl / length
    cup = bend_of[:, 0] - np.clip(across, 0.0, np.maximum(bend_of[:, 0], 0.0))
    poses[:, BEND] = np.clip(bend, -1.2 / length, 1.6 / length)
    poses[:, CUP] = np.clip(cup, -0.5 / length, 2.0 / length)
    poses[:, TWIST] = np.clip(bend_of[:, 2], -0.6 / length, 0.6 / length)
    frames = turned(frames, yaw)
    roots = stand.positions + (ABOVE_SKIN * bed.ground.spacing[:, None] * normals).astype(np.float32)
    feathers = Feathers(own, np.ascontiguousarray(roots, np.float32), frames, rank)
    return Base(feathers, poses, fields)


def changed_rows(before: Base, after: Base) -> NDArray[np.int32] | None:
    """Rows (n,) int32 whose pose, frame or vane differ; None when the feathers are others."""
    if before.feathers.own.shape != after.feathers.own.shape:
        return None
    if not np.array_equal(before.feathers.roots, after.feathers.roots):
        return None
    differ = (before.poses != after.poses).any(axis=1)
    differ |= (before.feathers.frames != after.feathers.frames).any(axis=(1, 2))
    if before.feathers.own is not after.feathers.own:
        differ |= (before.feathers.own != after.feathers.own).any(axis=(1, 2, 3))
    return np.flatnonzero(differ).astype(np.int32)


def curved(
    positions: NDArray[np.float32], frames: NDArray[np.float32], near: NDArray[np.int32], ranges: Any
) -> NDArray[np.float64]:
    """Curvature of the skin (N, 3) below feathers, 1 / metre: across, along, mixed; smooth between neighbours."""
    return smoothed(curvatures(positions, frames, near, ranges), near, 2, ranges)


def limited(length: NDArray[np.float64], bend: NDArray[np.float64]) -> NDArray[np.float64]:
    """Factor (N,) on lengths where the body bends too much below them for a feather to follow it."""
    tight = np.maximum(np.abs(bend[:, 0]), np.abs(bend[:, 1]))
    return np.asarray(1.0 / np.sqrt(1.0 + (length * tight / BODY) ** 2))


def drawn_in(
    length: NDArray[np.float64], rest_bend: NDArray[np.float64], bend: NDArray[np.float64], strain: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Factor (N,) on lengths where the skin moves: a smooth function of it alone, so that few feathers come to cross.

    rest_bend, bend : (N, 3), see ``curved``. strain : (N,), see ``strained``.
    """
    turned_by = length * np.abs(bend - rest_bend).max(axis=1)
    return np.asarray(1.0 / (1.0 + YIELD * (strain + turned_by)))


def strained(
    rest: NDArray[np.float32], rest_frames: NDArray[np.float32], posed: NDArray[np.float32],
    posed_frames: NDArray[np.float32], near: NDArray[np.int32],
) -> NDArray[np.float64]:
    """How far the neighbours of N roots moved about them, (N,) float64, over how far they stood: stretch and shear.

    rest, posed : (N, 3) positions, with their frames (N, 3, 3). near : (N, K) int32, -1 where there is none.
    """
    there = near >= 0
    offsets = [
        np.einsum("nij,nkj->nki", frames, points[near].astype(np.float64) - points[:, None])
        for points, frames in ((rest, rest_frames), (posed, posed_frames))
    ]
    moved = np.where(there, np.linalg.norm(offsets[1] - offsets[0], axis=2), 0.0).sum(axis=1)
    stood = np.where(there, np.linalg.norm(offsets[0], axis=2), 0.0).sum(axis=1)
    return np.asarray(moved / np.maximum(stood, 1e-30))


def own_curves(own: NDArray[np.float32]) -> NDArray[np.float64]:
    """How vanes (N, R, C, 3) at length 1 curve by themselves, (N, 2), across and along, towards the skin above 0."""
    x2, y2 = own[..., 0].astype(np.float64) ** 2, own[..., 1].astype(np.float64) ** 2
    z = own[..., 2].astype(np.float64)
    a, b, c = (x2 * x2).sum((1, 2)), (x2 * y2).sum((1, 2)), (y2 * y2).sum((1, 2))
    p, q = (x2 * z).sum((1, 2)), (y2 * z).sum((1, 2))
    rest = np.maximum(a * c - b * b, 1e-30)
    return np.stack([-2.0 * (c * p - b * q) / rest, -2.0 * (a * q - b * p) / rest], axis=1)


def seed_of(coat: FeatherCoat) -> int:
    """The seed of everything random about a coat."""
    return coat.placements[0].seed if coat.placements else 0
