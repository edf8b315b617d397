"""From poses to weights: the system of a pose space solved once, and the poses named that make it insoluble.

With K the kernel between all centres, the weights of the samples at a pose p are phi(p) K^-1: one small matrix for
all vertices that know the same poses. Rest and anchors are centres too, whose weights multiply nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.core.types import float64, void
from numpy.typing import NDArray

from core.pose.embedding import WIDTHS, embed, scales
from core.pose.kernels import AFFINE, POSITIVE, inverse_squares, kernel
from core.pose.pose import REST, Pose
from core.pose.pose_space import Dof, PoseSample, PoseSpace
from core.pose.refusal import Refusal
from core.transform import Array

LEAST_CONDITION = 1e-12  # smallest over largest singular value below which a system counts as singular
DOUBTFUL = 1e-10  # the same by a quick lower bound, above which nobody looks closer
TOO_CLOSE = 1e-6  # falloffs between two poses that no system tells apart
NEAREST = 1e-3  # the same of poses made by hand: nearer ones, and weights beside them run up to many hundreds
MOST_LOSS = 1e-6  # by which rounding may miss a weight at its own pose


class Settings(NamedTuple):
    """What of a space the system depends on beside the places of its centres."""

    kernel: str = "gaussian"
    normalise: str = "none"
    affine: bool = False
    clamp: bool = False
    smoothing: float = 0.0
    table: int = 0


class Plane(NamedTuple):
    """The affine part: columns 1 and (x - middle) @ across, of about the size of the kernel's."""

    middle: Array
    across: Array
    size: float


class Solved(NamedTuple):
    """A pose space ready to give weights.

    names : of the centres: rest, anchors, samples. silent : how many of them come before the samples.
    centres, scales : (C, D) where they lie before falloffs, and one over the falloffs of each.
    inverse : (C + q, C), from kernel and affine columns to weights; None for Shepard, who solves nothing.
    plane : the affine part, or None.
    reciprocal_condition : smallest over largest singular value; above 1e-10 a lower bound of it.
    loss : (C,) by how much the weights at each centre miss 1 for itself and 0 for the others.
    """

    dofs: tuple[Dof, ...]
    settings: Settings
    names: tuple[str, ...]
    silent: int
    centres: Array
    scales: Array
    inverse: Array | None
    plane: Plane | None
    reciprocal_condition: float
    loss: Array


def solve(
    space: PoseSpace, known: NDArray[np.bool_] | None = None, weights: NDArray[np.float64] | None = None
) -> Solved:
    """Solve a pose space.

    Parameters
    ----------
    known : (M,) which samples to take; all when None.
    weights : (len(dofs),) of the dofs, where distance is weighted by skin.

    Raises
    ------
    Refusal
        Naming the poses that are one and the same, lie in a plane, or cannot be told apart.
    """
    samples = space.samples if known is None else [s for s, take in zip(space.samples, known, strict=True) if take]
    poses = [REST, *space.anchors, *(s.pose for s in samples)]
    usual = scales(space.dofs, None, weights)
    settings = Settings(
        space.kernel, space.normalise, space.affine, space.clamp, space.smoothing, space.table)
    return solve_centres(
        embed(space.dofs, poses), _scales_of_each(space, samples, usual, weights), usual, settings,
        tuple(p.name for p in poses), space.dofs, 1 + len(space.anchors))


def refuse_near(space: PoseSpace) -> None:
    """Refusal naming poses that are so near each other that somebody made one of them by mistake.

    Asked when poses are made; a space that has such poses from elsewhere can still be solved.
    """
    poses = [REST, *space.anchors, *(s.pose for s in space.samples)]
    places, each = embed(space.dofs, poses), _scales_of_each(space, space.samples, scales(space.dofs))
    squared = _squared_distances(places, places, each)
    silent = 1 + len(space.anchors)
    squared[:silent, :silent] = np.inf  # their weights multiply nothing
    _refuse_twins(squared, tuple(p.name for p in poses), NEAREST)


def solve_centres(
    centres: Array, each: Array, usual: Array, settings: Settings, names: tuple[str, ...],
    dofs: tuple[Dof, ...] = (), silent: int = 0,
) -> Solved:
    """Solve for centres (C, D) given as coordinates, with the scales (C, D) of each and the usual ones (D,)."""
    count = len(centres)
    squared = _squared_distances(centres, centres, each)
    _refuse_twins(squared, names, TOO_CLOSE)
    if settings.kernel == "shepard" or count == 1:  # of one centre the weight is 1 everywhere
        exact = np.zeros(count)
        return Solved(dofs, settings, names, silent, centres, each, None, None, 1.0, exact)
    phi = kernel(settings.kernel, centres.shape[1], settings.table)
    matrix = phi(squared)
    symmetric = bool((each == each[0]).all())
    plane = None
    if settings.affine or settings.kernel in AFFINE:
        plane = _plane(centres, usual, dofs, names, float(np.abs(matrix).sum(axis=1).max()) or 1.0)
    system = _system(matrix, centres, plane, settings.smoothing)
    if not symmetric:
        _refuse_turned(matrix, system, centres, usual, phi, plane, settings, names)
    inverse, least = _inverse(system, names)
    if symmetric and settings.table and settings.kernel in POSITIVE and np.linalg.eigvalsh(matrix)[0] <= 0.0:
        raise Refusal("singular", names, "the table of the kernel is too coarse for them; give it more entries")
    inverse = inverse[:, :count]
    met = (matrix if plane is None else np.hstack([matrix, _affine_columns(centres, plane)])) @ inverse
    met.flat[:: count + 1] -= 1.0
    loss = np.abs(met).max(axis=1, initial=0.0)
    if settings.smoothing == 0.0 and loss.max() > MOST_LOSS:
        raise Refusal("singular", _guilty(_weakest(system, names)[1], names))
    return Solved(dofs, settings, names, silent, centres, each, inverse, plane, least, loss)


def weights(solved: Solved, pose: Pose) -> Array:
    """Weights (M,) float64 of the samples at a pose."""
    return weights_at(solved, embed(solved.dofs, [pose]))[0, solved.silent :]


def weights_at(solved: Solved, places: Array) -> Array:
    """Weights (N, C) of all centres, rest and anchors included, at coordinates (N, D) before falloffs."""
    settings = solved.settings
    if settings.clamp:
        places = np.clip(places, solved.centres.min(axis=0), solved.centres.max(axis=0))
    if solved.inverse is None:
        return inverse_squares(_squared_distances(places, solved.centres, solved.scales))
    phi = kernel(settings.kernel, solved.centres.shape[1], settings.table)
    found: Array = _columns(places, solved.centres, solved.scales, phi, solved.plane) @ solved.inverse
    if settings.normalise == "above-one":
        found = found / np.maximum(found.sum(axis=1, keepdims=True), 1.0)
    elif settings.normalise == "always":
        # of the sizes: the plain sum passes through 0 where some weights are negative
        found = found / np.maximum(np.abs(found).sum(axis=1, keepdims=True), 1e-300)
    return found


def _scales_of_each(
    space: PoseSpace, samples: Sequence[PoseSample], usual: Array, weights: NDArray[np.float64] | None = None
) -> Array:
    """The scales (C, D) of all centres: rest, anchors, samples."""
    own = [*[space.rest_falloffs] * (1 + len(space.anchors)), *(s.falloffs for s in samples)]
    each = np.tile(usual, (len(own), 1))
    for row, falloffs in enumerate(own):
        if falloffs:
            each[row] = scales(space.dofs, falloffs, weights)
    return each


def _squared_distances(places: Array, centres: Array, each: Array) -> Array:
    """(N, C), each centre measuring with its own scales."""
    out = np.zeros((len(places), len(centres)))
    p, c, e = (np.ascontiguousarray(a, np.float64) for a in (places, centres.T, each.T))
    _measure(p, c, e, out)
    return out


@njit(void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1]), cache=True, nogil=True)
def _measure(places: np.ndarray, centres: np.ndarray, each: np.ndarray, out: np.ndarray) -> None:
    # centres and scales (D, C): many centres at a time
    for n in range(len(places)):
        for d in range(len(centres)):
            for c in range(centres.shape[1]):
                apart = (places[n, d] - centres[d, c]) * each[d, c]
                out[n, c] += apart * apart


def _columns(places: Array, centres: Array, each: Array, phi: Callable[[Array], Array], plane: Plane | None) -> Array:
    found = phi(_squared_distances(places, centres, each))
    return found if plane is None else np.hstack([found, _affine_columns(places, plane)])


def _affine_columns(places: Array, plane: Plane) -> Array:
    ones = np.full((len(places), 1), plane.size)
    return np.hstack([ones, plane.size * ((places - plane.middle) @ plane.across)])


def _system(matrix: Array, centres: Array, plane: Plane | None, smoothing: float) -> Array:
    count = len(matrix)
    if plane is None:
        return matrix + smoothing * np.eye(count) if smoothing else matrix
    columns = _affine_columns(centres, plane)
    system = np.zeros((count + columns.shape[1],) * 2)
    system[:count, :count] = matrix + smoothing * np.eye(count)
    system[:count, count:] = columns
    system[count:, :count] = columns.T
    return system


def _inverse(system: Array, names: tuple[str, ...]) -> tuple[Array, float]:
    """The inverse and a reciprocal condition; Refusal when that of the singular values is below the least.

    The condition by sums of columns bounds it within the size of the system, so singular values, many times slower,
    are only sought where the bound leaves a doubt.
    """
    try:
        # numpy's alone: two linear algebra libraries, each with its threads, wait for each other
        inverse: Array = np.asarray(np.linalg.inv(system), np.float64)
        least = 1.0 / float(np.abs(system).sum(axis=0).max() * np.abs(inverse).sum(axis=0).max() * len(system))
    except np.linalg.LinAlgError:
        least = 0.0
    if least > DOUBTFUL:
        return inverse, least
    least, share = _weakest(system, names)
    if not least >= LEAST_CONDITION:
        raise Refusal("singular", _guilty(share, names))
    return inverse, least


def _weakest(system: Array, names: tuple[str, ...]) -> tuple[float, Array]:
    """Smallest over largest singular value, and how much of each pose is in the directions that are as good as lost.

    All of them, not the last alone: three poses in one place lose two.
    """
    _, sizes, directions = np.linalg.svd(system)
    lost = sizes <= max(LEAST_CONDITION * sizes[0], 2.0 * sizes[-1])
    share = np.linalg.norm(directions[lost][:, : len(names)], axis=0)
    return (float(sizes[-1] / sizes[0]) if sizes[0] > 0.0 else 0.0), share


def _refuse_twins(squared: Array, names: tuple[str, ...], closest: float) -> None:
    # the larger of both distances: a pose of endless falloff has everything near
    near = np.maximum(squared, squared.T) < closest**2
    np.fill_diagonal(near, False)
    guilty = near.any(axis=1)
    if guilty.any():
        same = np.maximum(squared, squared.T)[near].max() < 1e-24
        raise Refusal("duplicate" if same else "near-duplicate", tuple(np.array(names, object)[guilty]))


def _plane(centres: Array, usual: Array, dofs: Sequence[Dof], names: tuple[str, ...], size: float) -> Plane:
    """The affine part over the directions the poses go in; Refusal where they lie in a plane by mistake.

    Axes nobody uses are dropped: of a joint every direction its poses do not reach (a hinge moves its axis in a plane),
    of places and numbers those that stay the same. Of what is left, fewer poses than dimensions span what they can.
    """
    middle = centres.mean(axis=0)
    apart = (centres - middle) * usual
    at, dimensions = 0, 0
    for width, turning in [(WIDTHS[d.kind], d.kind not in ("translation", "number")) for d in dofs] or [
        (1, False)
    ] * centres.shape[1]:
        part = apart[:, at : at + width]
        dimensions += _rank(part) if turning else int((np.ptp(part, axis=0) > TOO_CLOSE).sum())
        at += width
    _, lengths, directions = np.linalg.svd(apart, full_matrices=False)
    rank = _rank(apart)
    if rank < min(len(centres) - 1, dimensions):
        raise Refusal("coplanar", names)
    across = (directions[:rank] / lengths[:rank, None] * np.sqrt(len(centres))).T * usual[:, None]
    return Plane(middle, across, size / float(np.sqrt(len(centres))))


def _rank(apart: Array) -> int:
    lengths = np.linalg.svd(apart, compute_uv=False)
    return int((lengths > TOO_CLOSE * max(1.0, lengths.max(initial=0.0))).sum())


def _refuse_turned(
    matrix: Array, system: Array, centres: Array, usual: Array, phi: Callable[[Array], Array], plane: Plane | None,
    settings: Settings, names: tuple[str, ...],
) -> None:
    """Refuse falloffs so unlike that the system has gone through a singular one on the way from equal falloffs.

    A real eigenvalue at or below 0, relative to the symmetric system, tells of it; its vector tells of the poses.
    """
    if settings.kernel in POSITIVE and plane is None:
        relative: Array = matrix
    else:
        equal = phi(_squared_distances(centres, centres, np.broadcast_to(usual, centres.shape)))
        base = _system(equal, centres, plane, settings.smoothing)
        if np.linalg.cond(base) > 1.0 / LEAST_CONDITION:
            return
        relative = np.asarray(np.linalg.solve(base, system), np.float64)
    values, vectors = np.linalg.eig(relative)
    turned = (np.abs(values.imag) <= 1e-9 * np.abs(values)) & (values.real <= 0.0)
    if turned.any():
        sizes = np.linalg.norm(vectors[: len(names), turned], axis=1)
        raise Refusal("unsymmetric", _guilty(sizes, names))


def _guilty(sizes: Array, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for name, size in zip(names, sizes, strict=True) if size >= 0.25 * sizes.max())
