"""One rig by several methods, side by side: what the course shows in its figures 7 to 10."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from core.pose.corrective import as_kind
from core.pose.edit_layers import refresh
from core.pose.pose_space import Correctives
from core.pose.rig import Rig

Method = Literal["skin", "interpolation", "linear", "combination", "pose-space", "weighted"]
METHODS: tuple[Method, ...] = get_args(Method)
LABELS: dict[Method, str] = {
    "skin": "Skin only (SSD)", "interpolation": "Shape interpolation (SI)", "linear": "Plain correctives, linear",
    "combination": "Plain correctives, combined", "pose-space": "Pose space (PSD)", "weighted": "Weighted (WPSD)",
}
WEIGHTED_STEPS = 8


def compared(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives | None, method: Method
) -> Correctives | None:
    """The sculpts of a rig as another method takes them; None where it takes none.

    Deterministic in its arguments, to be remembered by an evaluator: "weighted" extracts every layer anew.

    Raises
    ------
    Refusal
        Naming poses that weighted distances cannot tell apart.
    """
    if correctives is None or method == "skin":
        return None
    own = as_kind(correctives, "pose-space" if method == "weighted" else method)
    if method not in ("pose-space", "weighted"):
        return own
    steps = WEIGHTED_STEPS if method == "weighted" else 0
    if all(layer.space.weighted == steps for layer in own.layers):
        return own
    layers = tuple(layer.replace(space=layer.space.replace(weighted=steps)) for layer in own.layers)
    return refresh(points, rig, Correctives(layers=layers)).correctives
