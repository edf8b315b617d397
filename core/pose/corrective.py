"""What pose spaces are compared with: shapes that fade in as the pose moves towards their own, and shapes mixed."""

from __future__ import annotations

import numpy as np

from core.pose.embedding import WIDTHS, embed, scales
from core.pose.pose import REST, Pose
from core.pose.pose_space import Correctives, PoseLayer, Way
from core.transform import Array


def plain_weights(layer: PoseLayer, pose: Pose) -> Array:
    """Weights (M,) of the samples of a layer of kind "linear", "combination" or "interpolation".

    Linear: how far the pose has gone along the straight way from rest to the pose of the sample, 0 .. 1. Combination:
    that of every control by itself, multiplied over those that the sample moves. Interpolation: the linear ones mixed
    so that at every sample its own is 1 and the others 0, as an artist keys the sliders of several shapes.
    """
    dofs, samples = layer.space.dofs, layer.space.samples
    poses = [REST, pose, *(s.pose for s in samples)]
    placed = embed(dofs, poses) * scales(dofs)
    here, there = placed[1] - placed[0], placed[2:] - placed[0]
    if layer.kind == "linear":
        return _progress(here, there)
    if layer.kind == "interpolation":
        at_samples = np.array([_progress(one, there) for one in there])
        mixed: Array = _progress(here, there) @ np.linalg.pinv(at_samples, rcond=1e-6)
        return mixed
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


def as_kind(correctives: Correctives, kind: Way) -> Correctives:
    """The same sculpts interpolated in another way: the switch by which the ways are compared."""
    changed: Correctives = correctives.replace(
        layers=tuple(layer.replace(kind=kind) for layer in correctives.layers))
    return changed
