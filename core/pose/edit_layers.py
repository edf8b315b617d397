"""Edits of layers after they are made: add, delete, merge and move poses, extract again, and see who disturbs whom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.leaves import same_bits
from core.pose.controls import rests
from core.pose.layers import (
    UNMOVED,
    Extracted,
    LayerReport,
    anchors_of,
    diagonal,
    extract_layer,
    sample_of,
    space_dofs,
    with_rest_falloffs,
)
from core.pose.pose import Pose, moved_controls
from core.pose.pose_space import REST_NAME, Correctives, Dof, Falloff, PoseLayer, PoseSample, PoseSpace
from core.pose.refusal import Refusal
from core.pose.resculpt import sculpted_again
from core.pose.rig import Rig
from core.pose.synthesis import Prepared, evaluate, prepare, prepare_layer, run_weights, whole_pose
from core.record import freeze
from core.transform import Array


def refresh(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives, first: int = 0, kept: Correctives | None = None
) -> Extracted:
    """Extract layers `first` and on again from their target surfaces, in order, each upon those below.

    Parameters
    ----------
    kept : what they were before an edit below: then at each of their poses the whole surface stays as it was, also
        where the layer had nothing to say. Otherwise such vertices follow the layers below.

    Raises
    ------
    Refusal
        Naming the poses that cannot be told apart.
    """
    ready: list[Prepared] = []
    layers: list[PoseLayer] = []
    reports: list[LayerReport] = []
    before = prepare(kept, rig)
    for i, layer in enumerate(correctives.layers):
        if i >= first and kept is not None:
            layer = _with_vertices(layer, np.arange(len(points), dtype=np.int32))
        if i >= first:
            below = [s.pose for lower in layers for s in lower.space.samples]
            space = layer.space.replace(anchors=anchors_of(layer.space, below))
            targets = np.where(layer.moved[..., None], layer.targets, np.float32(np.nan))
            if kept is not None:
                poses = [s.pose for s in space.samples]
                whole = np.array([evaluate(points, rig, kept, pose, prepared=before)[layer.vertices] for pose in poses])
                targets = np.where(layer.moved[..., None], layer.targets, whole)
            layer, report = extract_layer(
                points, rig, ready, layer.name, space, layer.vertices, targets, layer.moved, layer)
            reports.append(report)
        layers.append(layer)
        if layer.enabled:
            ready.append(prepare_layer(layer, rig))
    return Extracted(Correctives(layers=tuple(layers)), tuple(reports))


def add_sculpt(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives, pose: Pose, target: NDArray[Any],
    falloffs: Mapping[str, Falloff] | None = None, dofs: Sequence[Dof] | None = None, **options: Any,
) -> Extracted:
    """Correctives with one more sculpt (or a sculpt anew, when its pose has the name of one; it keeps its falloffs).

    It joins the space that moves the same controls; else a new space begins, below those that move more controls
    beside these. Only vertices it moves become its own. Later layers are extracted again, their sculpts
    held.

    Parameters
    ----------
    target : (V, 3), the surface as sculpted, object space.
    options : fields of a new :class:`PoseSpace`.
    """
    pose = whole_pose(pose, rig, points)
    controls = moved_controls(pose, rests(rig))
    if not controls:
        raise Refusal("duplicate", (REST_NAME, pose.name))
    kept = correctives
    had = find_pose(correctives, pose.name)
    if had is not None and correctives.layers[had[0]].space.controls != controls:
        correctives, had = without_pose(correctives, pose.name), None
    if had is not None and falloffs is None:
        falloffs = correctives.layers[had[0]].space.samples[had[1]].falloffs
    sample = sample_of(pose, falloffs or {}, controls)
    layers = list(correctives.layers)
    at = next((i for i, layer in enumerate(layers) if layer.space.controls == controls), None)
    if at is None:
        above = (i for i, layer in enumerate(layers) if set(layer.space.controls) > set(controls))
        at = next(above, len(layers))
        space = PoseSpace(dofs=space_dofs(rig, [pose], controls, dofs), samples=(sample,), **options)
        layers.insert(at, _layer(_free_name(layers, controls), space, np.zeros(0, np.int32)))
        k = 0
    else:
        k = len(layers[at].space.samples) if had is None else had[1]
    ready = prepare(Correctives(layers=tuple(layers[:at])), rig)
    sculpted = np.asarray(target, np.float32)
    perhaps = _perhaps_moved(points, rig, ready, pose, sculpted)
    found = None
    if had is not None and same_bits(layers[at].space.samples[k], sample):
        found = sculpted_again(points, rig, ready, layers[at], k, sculpted, perhaps)
    if found is None:
        found = _extracted(points, rig, layers, at, k, sample, ready, sculpted, perhaps)
    layers[at], report = found
    if at + 1 == len(layers):
        return Extracted(Correctives(layers=tuple(layers)), (report,))
    rest = refresh(points, rig, Correctives(layers=tuple(layers)), at + 1, kept)
    return Extracted(rest.correctives, (report, *rest.reports))


def _extracted(
    points: NDArray[np.float32], rig: Rig, layers: Sequence[PoseLayer], at: int, k: int, sample: PoseSample,
    ready: Sequence[Prepared], sculpted: NDArray[np.float32], perhaps: NDArray[np.int32],
) -> tuple[PoseLayer, LayerReport]:
    """The layer `at` with a sample as its `k`-th, extracted anew from the surface (V, 3) sculpted there."""
    samples = layers[at].space.samples
    sources = [None if i == k else i for i in range(max(len(samples), k + 1))]
    layer = _resampled(layers[at], (*samples[:k], sample, *samples[k + 1 :]), sources)
    layer = _with_vertices(layer, perhaps)
    targets = np.where(layer.moved[..., None], layer.targets, np.float32(np.nan))
    targets[k] = sculpted[layer.vertices]
    below = [s.pose for lower in layers[:at] for s in lower.space.samples]
    space = with_rest_falloffs(layer.space)
    space = space.replace(anchors=anchors_of(space, below))
    return extract_layer(
        points, rig, ready, layer.name, space, layer.vertices, targets, layer.moved, layer, (k,))


def find_pose(correctives: Correctives, name: str) -> tuple[int, int] | None:
    """The layer and the place in it of a sculpted pose, or None."""
    for i, layer in enumerate(correctives.layers):
        for k, sample in enumerate(layer.space.samples):
            if sample.name == name:
                return i, k
    return None


def place_of(correctives: Correctives, name: str) -> tuple[int, int]:
    """As :func:`find_pose`; UserError when there is none."""
    found = find_pose(correctives, name)
    if found is None:
        raise UserError(f"There is no sculpted pose {name!r}; choose one from the list of poses.")
    return found


def renamed_pose(correctives: Correctives, name: str, to: str) -> Correctives:
    """Correctives with another name for a sculpted pose, here and where layers above are silent at it."""
    named = to.strip()
    place_of(correctives, name)
    if not named or not named.isprintable() or len(named) > 255 or named == REST_NAME:
        raise UserError(f"A pose needs a name of its own of letters, not {REST_NAME!r}.")
    if named != name and find_pose(correctives, named) is not None:
        raise UserError(f"There is a pose {named!r} already; choose another name.")

    def pose(one: Pose) -> Pose:
        other: Pose = one.replace(name=named) if one.name == name else one
        return other

    layers = []
    for layer in correctives.layers:
        space = layer.space.replace(
            samples=tuple(s.replace(pose=pose(s.pose)) for s in layer.space.samples),
            anchors=tuple(pose(anchor) for anchor in layer.space.anchors))
        layers.append(layer.replace(space=space))
    changed: Correctives = correctives.replace(layers=tuple(layers))
    return changed


def without_pose(correctives: Correctives, name: str) -> Correctives:
    """Correctives without that pose; a layer without poses goes as well. `refresh` the rest."""
    at, k = place_of(correctives, name)
    layer = correctives.layers[at]
    keep = [i for i in range(len(layer.space.samples)) if i != k]
    left = _resampled(layer, tuple(layer.space.samples[i] for i in keep), keep)
    some = (left,) if keep else ()
    changed: Correctives = correctives.replace(
        layers=(*correctives.layers[:at], *some, *correctives.layers[at + 1 :]))
    return changed


def merged_poses(correctives: Correctives, names: Sequence[str]) -> Correctives:
    """Correctives with poses of one layer as one, at the first of them, the sculpts averaged. `refresh` the rest."""
    places = [place_of(correctives, name) for name in names]
    if len({i for i, _ in places}) != 1 or len(places) < 2:
        raise UserError("Only poses of one layer can be merged; choose two or more of the same layer.")
    at, chosen = places[0][0], [k for _, k in places]
    layer = correctives.layers[at]
    share = layer.moved[chosen].astype(np.float32)[..., None]
    total = np.maximum(share.sum(axis=0), 1.0)
    deltas, targets, moved = layer.deltas.copy(), layer.targets.copy(), layer.moved.copy()
    deltas[chosen[0]] = (layer.deltas[chosen] * share).sum(axis=0) / total
    targets[chosen[0]] = (layer.targets[chosen] * share).sum(axis=0) / total
    moved[chosen[0]] = layer.moved[chosen].any(axis=0)
    merged = layer.replace(deltas=freeze(deltas), targets=freeze(targets), moved=freeze(moved))
    out: Correctives = correctives.replace(
        layers=(*correctives.layers[:at], merged, *correctives.layers[at + 1 :]))
    for name in names[1:]:
        out = without_pose(out, name)
    return out


def moved_pose(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives, name: str, pose: Pose
) -> Correctives:
    """Correctives with a sample at another pose; its corrections stay, its target is what they give there.

    `refresh` the rest.
    """
    at, k = place_of(correctives, name)
    layer = correctives.layers[at]
    pose = whole_pose(pose, rig, points).replace(name=name)
    alone = layer.replace(
        space=layer.space.replace(samples=(PoseSample(pose=pose),), anchors=(), kernel="gaussian", rest_falloffs={}),
        kind="pose-space", enabled=True, moved=freeze(layer.moved[k : k + 1] | True),
        deltas=freeze(layer.deltas[k : k + 1].copy()), targets=freeze(layer.targets[k : k + 1].copy()))
    surface = evaluate(points, rig, Correctives(layers=(*correctives.layers[:at], alone)), pose)
    targets = layer.targets.copy()
    targets[k] = surface[layer.vertices]
    samples = list(layer.space.samples)
    samples[k] = samples[k].replace(pose=pose)
    changed = layer.replace(space=layer.space.replace(samples=tuple(samples)), targets=freeze(targets))
    out: Correctives = correctives.replace(
        layers=(*correctives.layers[:at], changed, *correctives.layers[at + 1 :]))
    return out


def cross_talk(points: NDArray[np.float32], rig: Rig, correctives: Correctives) -> tuple[tuple[str, ...], Array]:
    """Who disturbs whom: names of all sculpted poses, and (N, N) float64 metres.

    Entry (i, j) is how far the sculpt j moves any vertex at the pose i, before skinning, though i belongs to the same
    layer or one below: 0 everywhere when every sculpt is met.
    """
    ready = prepare(correctives, rig)
    owners = [(i, s.pose) for i, layer in enumerate(correctives.layers) for s in layer.space.samples]
    first = np.cumsum([0, *(len(layer.space.samples) for layer in correctives.layers)])
    table = np.zeros((len(owners), len(owners)))
    for i, (lower, pose) in enumerate(owners):
        for item in ready:
            at = next(n for n, layer in enumerate(correctives.layers) if layer is item.layer)
            if at < lower or not len(item.places):
                continue
            runs = run_weights(item, pose)
            reach = np.abs(np.repeat(runs, np.diff(item.starts), axis=0)).T * np.linalg.norm(item.layer.deltas, axis=2)
            table[i, first[at] : first[at + 1]] = reach.max(axis=1)
        table[i, i] = 0.0
    return tuple(pose.name for _, pose in owners), table


def sculpt_errors(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives
) -> dict[str, NDArray[np.float32]]:
    """How far (n,) the surface at every sculpted pose is from the sculpt, at the vertices of its layer, metres."""
    ready = prepare(correctives, rig)
    out = {}
    for layer in correctives.layers:
        for k, sample in enumerate(layer.space.samples):
            posed = evaluate(points, rig, correctives, sample.pose, prepared=ready)[layer.vertices]
            out[sample.name] = np.linalg.norm(posed - layer.targets[k], axis=1)
    return out


def _layer(name: str, space: PoseSpace, vertices: NDArray[np.int32]) -> PoseLayer:
    shape = (len(space.samples), len(vertices))
    return PoseLayer(
        name=name, space=space, vertices=freeze(vertices), moved=freeze(np.zeros(shape, np.bool_)),
        after=freeze(np.zeros(shape[1], np.bool_)), deltas=freeze(np.zeros((*shape, 3), np.float32)),
        targets=freeze(np.zeros((*shape, 3), np.float32)))


def _with_vertices(layer: PoseLayer, vertices: NDArray[np.int32]) -> PoseLayer:
    """The layer with these vertices among its own, in whatever order; nobody has moved the new ones."""
    wanted = np.zeros(int(max(vertices.max(initial=-1), layer.vertices.max(initial=-1))) + 1, np.bool_)
    wanted[vertices] = True
    wanted[layer.vertices] = False
    new = np.flatnonzero(wanted).astype(np.int32)
    if not len(new):
        return layer

    def wider(array: NDArray[Any]) -> NDArray[Any]:
        axis = min(1, array.ndim - 1)
        shape = (*array.shape[:axis], len(new), *array.shape[axis + 1 :])
        return freeze(np.concatenate([array, np.zeros(shape, array.dtype)], axis=axis))

    whole: PoseLayer = layer.replace(
        vertices=freeze(np.concatenate([layer.vertices, new])), moved=wider(layer.moved), after=wider(layer.after),
        deltas=wider(layer.deltas), targets=wider(layer.targets))
    return whole


def _perhaps_moved(
    points: NDArray[np.float32], rig: Rig, below: Sequence[Prepared], pose: Pose, target: NDArray[np.float32]
) -> NDArray[np.int32]:
    """Vertices that a sculpt may have moved: those not just where the layers below put them, as near as float32 tells.

    What is moved by more than may be ignored is certainly among them.
    """
    posed = evaluate(points, rig, None, pose, prepared=tuple(below))
    rounding = 2.0 * float(np.finfo(np.float32).eps) * float(np.abs(posed).max(initial=0.0))
    least = max(UNMOVED * diagonal(points) / np.sqrt(3.0) - rounding, 0.0)
    near = np.abs(target - posed) <= least
    return np.flatnonzero(~(near[:, 0] & near[:, 1] & near[:, 2])).astype(np.int32)


def _resampled(layer: PoseLayer, samples: tuple[PoseSample, ...], sources: Sequence[int | None]) -> PoseLayer:
    """The layer with other samples, each from the row `sources` says, or of nothing; unmoved vertices are dropped."""
    def rows(array: NDArray[Any]) -> NDArray[Any]:
        out = np.zeros((len(sources), *array.shape[1:]), array.dtype)
        for to, source in enumerate(sources):
            if source is not None:
                out[to] = array[source]
        return out

    moved = rows(layer.moved)
    vertices, after, deltas, targets = layer.vertices, layer.after, rows(layer.deltas), rows(layer.targets)
    if None not in sources:
        used = np.flatnonzero(moved.any(axis=0))
        vertices, after = vertices[used], after[used]
        moved, deltas, targets = (array.take(used, axis=1) for array in (moved, deltas, targets))
    changed: PoseLayer = layer.replace(
        space=layer.space.replace(samples=samples), vertices=freeze(vertices), moved=freeze(moved),
        after=freeze(after), deltas=freeze(deltas), targets=freeze(targets))
    return changed


def _free_name(layers: Sequence[PoseLayer], controls: Sequence[str]) -> str:
    base = "+".join(controls)[:200]
    taken = {layer.name for layer in layers}
    return next(name for name in (base, *(f"{base} {i}" for i in range(2, len(taken) + 3))) if name not in taken)
