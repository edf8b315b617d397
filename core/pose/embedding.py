"""Where a pose lies in a pose space: coordinates in which straight distance is a sound measure of difference.

A joint becomes the place of its rotated axis (3) and the cosine and sine of its twist (2), each divided by a falloff.
A Gaussian of the straight distance between such points is positive definite whatever the poses, which one of the
angle between rotations is for no width (arXiv 2302.10623); and each axis has a falloff of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from core.pose.pose import Pose, Vector
from core.pose.pose_space import Dof, Falloff, PoseSpace
from core.pose.rotation import swung_and_twisted
from core.transform import Array

_REST_TURN, _REST_PLACE = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
WIDTHS = {"swing": 3, "twist": 2, "swing-twist": 5, "translation": 3, "number": 1}  # coordinates of a kind
READ = {"swing": slice(0, 3), "twist": slice(3, 5), "swing-twist": slice(0, 5)}  # of ``swung_and_twisted``


def chord(angle: float) -> float:
    """Straight distance of two points on the unit circle `angle` radians apart; above pi it goes on growing."""
    return 2.0 * math.sin(0.5 * angle) if angle <= math.pi else 2.0 * angle / math.pi


def embed(dofs: Sequence[Dof], poses: Sequence[Pose]) -> Array:
    """Coordinates (N, D) of poses before any falloff.

    For each dof, in order: of a swing the rotated axis along `axis`, `side` and axis x side; of a twist its cosine and
    sine, faded where the swing nears 180 degrees; of a translation x, y, z; a number.
    """
    out = np.empty((len(poses), sum(WIDTHS[d.kind] for d in dofs)))
    turning = [d for d in dofs if d.kind in ("swing", "twist", "swing-twist")]
    if turning:
        parts = (pose.rotations.get(d.control, _REST_TURN) for pose in poses for d in turning)
        q = np.fromiter(chain.from_iterable(parts), np.float64, 4 * len(poses) * len(turning))
        frames = np.array([_frame(d.axis, d.side) for d in turning], np.float64)
        turned = swung_and_twisted(q.reshape(len(poses), len(turning), 4), frames)
    at = turn = 0
    for dof in dofs:
        if dof.kind == "translation":
            out[:, at : at + 3] = [pose.translations.get(dof.control, _REST_PLACE) for pose in poses]
        elif dof.kind == "number":
            out[:, at] = [pose.numbers.get(dof.control, dof.rest) for pose in poses]
        else:
            out[:, at : at + WIDTHS[dof.kind]] = turned[:, turn, READ[dof.kind]]
            turn += 1
        at += WIDTHS[dof.kind]
    return out


def _frame(a: Vector, b: Vector) -> tuple[Vector, Vector, Vector]:
    return a, b, (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def scales(
    dofs: Sequence[Dof], own: Mapping[str, Falloff] | None = None, weights: NDArray[np.float64] | None = None
) -> Array:
    """What the coordinates (D,) are multiplied by: one over the falloffs.

    At a falloff's angle from a pose the distance is 1. Along the axis itself, where swings to both sides are felt, it
    is the root mean square of the two.

    Parameters
    ----------
    own : falloffs by control, in place of those of the dofs; of a joint that turns and moves, of how it turns.
    weights : (len(dofs),) by which squared distances are multiplied (weighted pose space deformation).
    """
    out: list[float] = []
    turning = {dof.control for dof in dofs if dof.kind not in ("translation", "number")}
    for i, dof in enumerate(dofs):
        falloff = (own or {}).get(dof.control, dof.falloff)
        if dof.kind == "translation" and dof.control in turning:
            falloff = dof.falloff
        share = 1.0 if weights is None else math.sqrt(float(weights[i]))
        if dof.kind in ("translation", "number"):
            count = WIDTHS[dof.kind]
            one = [1.0 / f for f in (falloff if len(falloff) == count else falloff * count)]
        else:
            parts = [1.0 / chord(f) for f in falloff]
            swing = parts[:2] if len(parts) > 1 else parts * 2
            one = [] if dof.kind == "twist" else [math.hypot(*swing) / math.sqrt(2.0), *swing]
            one += [] if dof.kind == "swing" else [parts[-1]] * 2
        out += [share * s for s in one]
    return np.array(out, np.float64)


def coordinates(pose: Pose, space: PoseSpace) -> Array:
    """Coordinates (D,) float64 of a pose, in falloffs of the space (samples with falloffs of their own aside)."""
    return embed(space.dofs, [pose])[0] * scales(space.dofs)
