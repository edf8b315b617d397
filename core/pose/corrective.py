"""Plain correctives, to compare with: shapes that fade in as the pose moves towards their own, simply added up."""

from __future__ import annotations

from typing import Literal

import numpy as np

from core.pose.embedding import WIDTHS, embed, scales
from core.pose.pose import REST, Pose
from core.pose.pose_space import Correctives, PoseLayer
from core.transform import Array


def plain_weights(layer: PoseLayer, pose: Pose) -> Array:
    """Weights (M,) of the samples of a layer of kind "linear" or "combination", 0 .. 1.

    Linear: how far the pose has gone along the straight way from rest to the pose of the sample. Combination: that
    of every control by itself, multiplied over those that the sample moves.
    """
    dofs, samples = layer.space.dofs, layer.space.samples
    poses = [REST, pose, *(s.pose for s in samples)]
    placed = embed(dofs, poses) * scales(dofs)
    here, there = placed[1] - placed[0], placed[2:] - placed[0]
    if layer.kind == "linear":
        return _progress(here, there)
    out = np.ones(len(samples))
    at = 0
    for dof in dofs:
        part = slice(at, at + WIDTHS[dof.kind])
        uses = np.linalg.norm(there[:, part], axis=1) > 1e-6
        out[uses] *= _progress(here[part], there[uses, part])
        at += WIDTHS[dof.kind]
    return out


def _progress(here: Array, there: Array) -> Array:
    lengths = np.einsum("md,md->m", there, there)
    return np.clip(there @ here / np.where(lengths > 0.0, lengths, 1.0), 0.0, 1.0)


def as_kind(correctives: Correctives, kind: Literal["pose-space", "linear", "combination"]) -> Correctives:
    """The same sculpts interpolated in another way: the switch by which the ways are compared."""
    changed: Correctives = correctives.replace(
        layers=tuple(layer.replace(kind=kind) for layer in correctives.layers))
    return changed
