"""Layers of sculpts: which space a sculpt belongs to, and its corrections as deltas from the layers below.

A space is made of the controls that its poses move. Spaces of fewer controls lie below, and the poses sculpted there
are anchors above, where a layer is silent: so every sculpt is met exactly, whatever was sculpted after it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.pose.controls import dofs_of, rests
from core.pose.embedding import embed, scales
from core.pose.extraction import MOST_CONDITION, Affine, after_skinning, before_skinning, skin_affine, surface_rotations
from core.pose.pose import REST, Pose, local_of_pose, moved_controls
from core.pose.pose_space import REST_NAME, Correctives, Dof, Falloff, PoseLayer, PoseSample, PoseSpace
from core.pose.refusal import Refusal
from core.pose.rig import Rig
from core.pose.skinning import skin_matrices_of
from core.pose.solve import TOO_CLOSE, refuse_near, solve, weights_at
from core.pose.synthesis import Prepared, corrected, felt, prepare_layer, run_keys, skin_shares, whole_pose
from core.record import freeze
from core.transform import Array

UNMOVED = 2e-7  # of the mesh's diagonal: what a sculpt may differ by without being a sculpt


class Sculpt(NamedTuple):
    """A pose and the surface sculpted there: (V, 3) object space, or None for what the layers below give."""

    pose: Pose
    target: NDArray[np.floating[Any]] | None
    falloffs: Mapping[str, Falloff] = {}


class LayerReport(NamedTuple):
    """How a layer could be extracted.

    condition : (M, n) float32 of the skin at each vertex of the layer at each pose; 0 where it was not sculpted, or
        not extracted anew.
    flagged : (n,) the vertices that are corrected after skinning, for one of these is too large.
    """

    layer: str
    poses: tuple[str, ...]
    vertices: NDArray[np.int32]
    condition: NDArray[np.float32]
    flagged: NDArray[np.bool_]


class Extracted(NamedTuple):
    """Correctives and one report for each layer made anew."""

    correctives: Correctives
    reports: tuple[LayerReport, ...]


def build(
    points: NDArray[np.float32], rig: Rig, sculpts: Sequence[Sculpt], dofs: Sequence[Dof] | None = None,
    **options: Any,
) -> Extracted:
    """Layers of all sculpts at once; in whatever order they come, the result is the same.

    Parameters
    ----------
    points : (V, 3) float32, at rest.
    dofs : what is read of the controls, as picked; the usual of those that are not among them.
    options : fields of :class:`PoseSpace`, for all spaces.

    Raises
    ------
    Refusal
        Naming the poses that cannot be told apart.
    UserError
        When a pose names a control the rig does not have.
    """
    groups: dict[tuple[str, ...], list[Sculpt]] = {}
    at_rest = rests(rig)
    for sculpt in [s._replace(pose=whole_pose(s.pose, rig, points)) for s in sculpts]:
        groups.setdefault(moved_controls(sculpt.pose, at_rest), []).append(sculpt)
    if () in groups:
        raise Refusal("duplicate", (REST_NAME, *(s.pose.name for s in groups[()])))
    layers: list[PoseLayer] = []
    reports: list[LayerReport] = []
    ready: list[Prepared] = []
    vertices = np.arange(len(points), dtype=np.int32)
    for controls in sorted(groups, key=lambda names: (len(names), names)):
        group = groups[controls]
        space = PoseSpace(
            dofs=space_dofs(rig, [s.pose for s in group], controls, dofs),
            samples=tuple(sample_of(s.pose, s.falloffs, controls) for s in group), **options)
        space = with_rest_falloffs(space)
        space = space.replace(anchors=anchors_of(space, [s.pose for layer in layers for s in layer.space.samples]))
        targets = np.full((len(group), len(points), 3), np.nan)
        for k, sculpt in enumerate(group):
            if sculpt.target is not None:
                targets[k] = sculpt.target
        name = "+".join(controls)
        name = name if len(name) < 200 else f"{len(controls)} controls {len(layers) + 1}"
        layer, report = extract_layer(points, rig, ready, name, space, vertices, targets)
        layers.append(layer)
        reports.append(report)
        ready.append(prepare_layer(layer, rig))
    return Extracted(Correctives(layers=tuple(layers)), tuple(reports))


def sample_of(pose: Pose, falloffs: Mapping[str, Falloff], controls: Sequence[str]) -> PoseSample:
    """The sample of a pose in a space over `controls`; falloffs of others, which are at rest there, say nothing."""
    return PoseSample(pose=pose, falloffs={name: reach for name, reach in falloffs.items() if name in controls})


def with_rest_falloffs(space: PoseSpace) -> PoseSpace:
    """The space whose rest and anchors reach as far as its samples do.

    Along each control where every sample has a falloff of its own it is the median of them: poses given one falloff
    measure alike from wherever, and the system stays symmetric. Elsewhere it is that of the space.
    """
    found: dict[str, Falloff] = {}
    for control in space.controls:
        said = [s.falloffs[control] for s in space.samples if control in s.falloffs]
        if said and len(said) == len(space.samples):
            wide = max(map(len, said))
            found[control] = tuple(np.median([f if len(f) == wide else f * wide for f in said], axis=0).tolist())
    changed: PoseSpace = space.replace(rest_falloffs=found)
    return changed


def space_dofs(
    rig: Rig, poses: Sequence[Pose], controls: Sequence[str], picked: Sequence[Dof] | None = None
) -> tuple[Dof, ...]:
    """The degrees of freedom of a space over `controls`: as picked, else the usual ones."""
    mine = [dof for dof in picked or () if dof.control in controls]
    have = {dof.control for dof in mine}
    return (*mine, *(dof for dof in dofs_of(rig, poses) if dof.control in controls and dof.control not in have))


def anchors_of(space: PoseSpace, below: Sequence[Pose]) -> tuple[Pose, ...]:
    """The poses of layers below that this space must be told to be silent at.

    Not those that are rest to it, nor those it has a sample at: there it speaks, and `cross_talk` tells.
    """
    size = scales(space.dofs)
    taken = list(embed(space.dofs, [REST, *(s.pose for s in space.samples)]) * size)
    out = []
    for pose in below:
        place = embed(space.dofs, [pose])[0] * size
        if min(float(np.linalg.norm(place - other)) for other in taken) > TOO_CLOSE:
            taken.append(place)
            out.append(pose)
    return tuple(out)


def extract_layer(
    points: NDArray[np.float32], rig: Rig, below: Sequence[Prepared], name: str, space: PoseSpace,
    vertices: NDArray[np.int32], targets: NDArray[Any], moved: NDArray[np.bool_] | None = None,
    like: PoseLayer | None = None, fresh: Collection[int] | None = None,
) -> tuple[PoseLayer, LayerReport]:
    """The corrections of a space as deltas from the layers below.

    Parameters
    ----------
    vertices, targets : (n,) and (M, n, 3), the sculpted surfaces; NaN where a sculpt says nothing.
    moved : (M, n) what counts as sculpted in any case, or None.
    like : the layer whose kind and switch to keep.
    fresh : the samples to extract; those of the others are kept from `like`, which has these very `vertices`. All
        when None.

    Raises
    ------
    Refusal
        Naming the poses that cannot be told apart.
    """
    refuse_near(space)
    solve(space)
    least = UNMOVED * diagonal(points)
    poses, count = [s.pose for s in space.samples], len(space.samples)
    new = [k for k in range(count) if fresh is None or k in fresh]
    finite = np.isfinite(targets)
    given = finite[..., 0] & finite[..., 1] & finite[..., 2]
    sampled = np.zeros(given.shape, np.bool_) if moved is None else moved & given
    surfaces = np.where(given[..., None], targets, targets.dtype.type(0))
    states = {k: state_at(points, rig, below, poses[k], vertices) for k in new}
    for k, state in states.items():
        surfaces[k, ~given[k]] = state.posed[~given[k]]
        sampled[k] |= given[k] & (np.linalg.norm(surfaces[k] - state.posed, axis=1) > least)
    rows = np.flatnonzero(sampled.any(axis=0))
    vertices, sampled, surfaces = vertices[rows], _columns(sampled, rows), _columns(surfaces, rows)
    kept = like if like is not None and len(new) < count else None
    deltas = np.zeros(surfaces.shape, np.float32) if kept is None else kept.deltas.take(rows, axis=1)
    was_after = np.zeros(len(rows), np.bool_) if kept is None else kept.after[rows]
    condition = np.zeros(sampled.shape)
    for k, state in states.items():
        mine = sampled[k]
        at = rows[mine]
        affine = Affine(state.affine.turn[at], state.affine.move[at], state.affine.strongest[at])
        deltas[k, mine], condition[k, mine] = before_skinning(affine, surfaces[k, mine] - state.posed[at])
    flagged: NDArray[np.bool_] = was_after | np.any(condition > MOST_CONDITION, axis=0)
    for k in range(count):
        mine = sampled[k] & flagged & (True if k in states else ~was_after)
        if mine.any():
            state = state_at(points, rig, below, poses[k], vertices[mine])
            deltas[k, mine] = after_skinning(state.affine, state.matrices, surfaces[k, mine] - state.posed)
    shares = skin_shares(space.dofs, space.weighted, rig, vertices)
    known = sampled.copy()
    if like is None or like.kind == "pose-space":
        hold(space, known, deltas, shares, least)
    for k in range(count):
        held = known[k] & ~sampled[k]
        if k not in states and held.any():  # nobody sculpted them there: they stay where the layers below have them
            surfaces[k, held] = state_at(points, rig, below, poses[k], vertices[held]).posed
    keys = run_keys(flagged, known, shares)
    order = np.lexsort(keys[::-1]) if len(rows) else np.zeros(0, np.int64)
    layer = PoseLayer(
        name=name, space=space, kind="pose-space" if like is None else like.kind,
        enabled=like is None or like.enabled,
        vertices=freeze(vertices[order].astype(np.int32)), moved=freeze(_columns(known, order)),
        after=freeze(flagged[order]), deltas=freeze(_columns(deltas, order)),
        targets=freeze(_columns(surfaces.astype(np.float32, copy=False), order)))
    report = LayerReport(
        name, tuple(p.name for p in poses), layer.vertices, condition[:, order].astype(np.float32), layer.after)
    return layer, report


def _columns(array: NDArray[Any], rows: NDArray[np.intp]) -> NDArray[Any]:
    """Of an array (M, n, ...) the columns `rows`; itself where these are all of them as they stand."""
    if len(rows) == array.shape[1] and bool((rows[1:] > rows[:-1]).all()):
        return array
    return array.take(rows, axis=1)


def diagonal(points: NDArray[np.float32]) -> float:
    """Of the box around points (V, 3); 0 without any. By columns, many times as fast as along the first axis."""
    return float(np.linalg.norm([np.ptp(points[:, k]) for k in range(3)])) if len(points) else 0.0


class State(NamedTuple):
    """Of n vertices at a pose.

    matrices : (J, 4, 4) of the skin. posed : (n, 3) float64, object space, with all layers below.
    """

    matrices: Array
    affine: Affine
    posed: Array


def state_at(
    points: NDArray[np.float32], rig: Rig, below: Sequence[Prepared], pose: Pose, vertices: NDArray[np.int32]
) -> State:
    """What the skin does at a pose to some vertices, and where the layers below have them."""
    local = local_of_pose(rig.skeleton, pose)
    matrices = skin_matrices_of(rig.skeleton, local)
    morphed, late = corrected(points, rig, tuple(below), felt(pose, rig, points, local))
    affine = skin_affine(rig, matrices, vertices)
    posed = np.einsum("nij,nj->ni", affine.turn, morphed[vertices].astype(np.float64)) + affine.move
    if late:
        moves = np.zeros((len(points), 3))
        for places, frame_moves in late:
            turn = surface_rotations(skin_affine(rig, matrices, places), matrices)
            moves[places] += np.einsum("nij,nj->ni", turn, frame_moves.astype(np.float64))
        posed += moves[vertices]
    return State(matrices, affine, posed)


def hold(
    space: PoseSpace, known: NDArray[np.bool_], deltas: NDArray[np.float32], shares: Array, least: float
) -> None:
    """Add to the samples of each vertex, in place, those poses where it would be moved though nobody sculpted it.

    Vertices that know the same poses are asked together. Of sets that cannot be solved by themselves (three of four
    poses may lie in a plane) all poses are taken.
    """
    places = embed(space.dofs, [s.pose for s in space.samples])
    while not known.all():
        changed = False
        keys = run_keys(np.zeros(known.shape[1], np.bool_), known, shares)
        order = np.lexsort(keys[::-1])
        starts = np.flatnonzero((np.diff(keys[:, order], axis=1) != 0).any(axis=0)) + 1
        for rows in np.split(order, starts):
            mine = known[:, rows[0]].copy()
            if mine.all():
                continue
            try:
                solved = solve(space, mine, shares[rows[0]] if shares.size else None)
            except Refusal:
                known[:, rows] = True
                changed = True
                continue
            others = np.flatnonzero(~mine)
            share = weights_at(solved, places[others])[:, solved.silent :]
            moves = np.einsum("om,mnd->ond", share, deltas[mine][:, rows].astype(np.float64))
            found = np.linalg.norm(moves, axis=2) > least
            if found.any():
                known[others[:, None], rows[None]] |= found
                changed = True
        if not changed:
            return
