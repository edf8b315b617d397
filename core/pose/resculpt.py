"""A further stroke at a pose that is sculpted already: only the vertices it moved are extracted.

The rest of the layer, often a hundred times as much, is taken over as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.pose.extraction import MOST_CONDITION, after_skinning, before_skinning
from core.pose.layers import UNMOVED, LayerReport, diagonal, hold, state_at
from core.pose.pose_space import PoseLayer
from core.pose.rig import Rig
from core.pose.synthesis import Prepared, skin_shares
from core.record import freeze


def sculpted_again(
    points: NDArray[np.float32], rig: Rig, below: Sequence[Prepared], layer: PoseLayer, k: int,
    target: NDArray[np.float32], perhaps: NDArray[np.int32],
) -> tuple[PoseLayer, LayerReport] | None:
    """The layer with another surface (V, 3) at its sample `k`; None where more changes than corrections of vertices.

    That is where the stroke moves vertices that were not sculpted there, brings some back to where the layers below
    have them, or where the skin of one cannot be inverted any more: then the layer must be extracted anew.

    Parameters
    ----------
    perhaps : vertices that the layers below may put elsewhere than `target` does.
    """
    least = UNMOVED * diagonal(points)
    pose = layer.space.samples[k].pose
    mine = np.flatnonzero(layer.moved[k])
    elsewhere = np.ones(len(points), np.bool_)
    elsewhere[layer.vertices[mine]] = False
    others = perhaps[elsewhere[perhaps]]
    if len(others) and _missing(target[others], state_at(points, rig, below, pose, others).posed).max() > least:
        return None
    new = target[layer.vertices[mine]]
    changed = _missing(new, layer.targets[k, mine]) > least
    mine, new = mine[changed], new[changed]
    vertices = layer.vertices[mine]
    state = state_at(points, rig, below, pose, vertices)
    if _missing(new, state.posed).min(initial=np.inf) <= least:
        return None
    late = layer.after[mine]
    delta, condition = before_skinning(state.affine, new - state.posed)
    if (condition[~late] > MOST_CONDITION).any():
        return None
    if late.any():
        delta[late] = after_skinning(state.affine, state.matrices, new - state.posed)[late]
    deltas = layer.deltas.copy()
    deltas[k, mine] = delta
    if layer.kind == "pose-space":
        known = layer.moved[:, mine].copy()
        hold(layer.space, known, deltas[:, mine], skin_shares(layer.space.dofs, layer.space.weighted, rig, vertices),
             least)
        if (known != layer.moved[:, mine]).any():
            return None
    targets = layer.targets.copy()
    targets[k, mine] = new
    conditions = np.zeros(layer.moved.shape, np.float32)
    conditions[k, mine] = condition
    names = tuple(sample.name for sample in layer.space.samples)
    made: PoseLayer = layer.replace(deltas=freeze(deltas), targets=freeze(targets))
    return made, LayerReport(layer.name, names, layer.vertices, conditions, layer.after)


def _missing(one: NDArray[np.float32], other: NDArray[Any]) -> NDArray[np.float64]:
    """How far (n,) points are apart."""
    found: NDArray[np.float64] = np.linalg.norm(one.astype(np.float64) - other, axis=1)
    return found
