"""From what a reader of rigs found to a sound rig: what is wrong is repaired with a word or refused in a sentence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats import usd_corrections
from core.formats.rig_parts import RawClip, RawRig, RawShape, parents_first
from core.mesh.mesh import Mesh
from core.mesh.repair import PROBLEMS, repair
from core.pose.blend_shapes import LEAST_APART, BlendShapes
from core.pose.clip import check_frames, split_matrices, without_flips
from core.pose.pose_space import Correctives
from core.pose.rig import Control, Rig, all_clips
from core.pose.skeleton import Clip, Skeleton
from core.pose.weights import compacted, no_skin
from core.record import freeze

MOST_JOINTS, MOST_TARGETS, MOST_OFFSETS = 10_000, 20_000, 200_000_000
LARGEST = 1e12  # metres or parts of a matrix; beyond it single precision overflows in a few steps
STILL = "still"  # the joint of what no joint of the file moves


class NoRig(UserError):
    """The file has a mesh perhaps, but nothing that moves it."""


class RigFile(NamedTuple):
    """A rig as read and repaired.

    mesh : metres, Y up, where its skeleton rests; None of a file that has only a skeleton (BVH, TGF).
    rig : its skin has one row for each vertex of `mesh`; its first clip plays.
    clips : all clips. notes : sentences to show.
    name : of the file, without its suffix. metres_per_unit, up : the space that was used.
    correctives : where we wrote the file ourselves.
    """

    mesh: Mesh | None
    rig: Rig
    clips: tuple[Clip, ...]
    notes: tuple[str, ...]
    name: str
    metres_per_unit: float
    up: str
    correctives: Correctives | None = None


def assemble(raw: RawRig, name: str, metres_given: float | None, up_given: str | None) -> RigFile:
    """A sound rig of what a reader found, in metres, Y up; what was repaired is said in its notes.

    Raises
    ------
    NoRig, UserError
        As :func:`read_rig`.
    """
    notes = list(raw.notes)
    if not raw.names and not raw.shapes and not raw.clips:
        raise NoRig("it has no skeleton, blend shapes or clips; export the rig with its mesh.")
    if len(raw.names) > MOST_JOINTS or len(raw.shapes) > MOST_TARGETS:
        raise UserError(f"it has more than {MOST_JOINTS:,} joints or {MOST_TARGETS:,} targets; export a part of it.")
    if sum(len(shape.vertices) for shape in raw.shapes) > MOST_OFFSETS:
        raise UserError("its blend shapes are too large; export a part of them.")
    metres = raw.metres_per_unit
    if metres is None or not 1e-9 < metres < 1e9:
        metres = 1.0 if metres_given is None else metres_given
        if metres_given is None:
            notes.append(f"{name} does not say its unit: metres assumed; set --unit to change that.")
    up = raw.up if raw.up in ("y", "z") else (up_given or "y")
    found = raw.sculpts
    same_space = metres == 1.0 and up == "y" and raw.polygons is not None
    if found is not None and same_space and usd_corrections.fits(found, raw.polygons.points):  # type: ignore[union-attr]
        raw = usd_corrections.without_corrections(raw)
    elif found is not None:
        found = None
        notes.append("Its mesh is not the one its corrections were sculpted on; they are blend shapes now.")
    raw = _to_metres(raw, metres, up)
    skeleton, row_of = _skeleton(raw, notes)
    mesh, file_vertices, skin, shapes, dual = None, None, no_skin(0), None, None
    if raw.polygons is not None:
        joints, weights = _skin(raw, row_of, len(skeleton.names), notes)
        if (joints == len(skeleton.names)).any():
            skeleton = _with_still(skeleton)
        targets = _targets(raw, notes)
        repaired = repair(raw.polygons, _alike(joints, weights, targets, raw.dual, len(raw.polygons.points)))
        mesh = repaired.mesh
        went = repaired.vertex_of_source
        first = np.unique(went, return_index=True)[1]
        skin = compacted(joints[first], weights[first])
        dual = None if raw.dual is None else freeze(raw.dual[first])
        shapes = _shapes(targets, went, first)
        if len(first) < len(went):
            file_vertices = freeze(went.astype(np.int32))
            notes.append(
                f"{len(went) - len(first):,} vertices doubled along seams are welded in the mesh; "
                "results keep the vertices of the file."
            )
        met = {k: n for k, n in repaired.problems.items() if k not in ("islands", "missing_uvs", "duplicate_vertices")}
        if met:
            notes.append("Worked around: " + ", ".join(f"{n} {PROBLEMS[k]}" for k, n in met.items()) + ".")
    controls = _controls(raw, skeleton, shapes)
    renamed = {was: now.name for was, now in zip(() if shapes is None else shapes.names, controls)}
    if shapes is not None:
        shapes = shapes.replace(names=tuple(renamed[name] for name in shapes.names))
    clips = _clips(raw, skeleton, row_of, renamed, notes)
    rig = Rig(
        skeleton=skeleton, skin=skin, clip=clips[0] if clips else None, clips=clips[1:], shapes=shapes,
        skinning=raw.skinning, dual=dual, controls=controls, file_vertices=file_vertices,
    )
    correctives = None
    if found is not None and mesh is not None:
        try:
            if not usd_corrections.fits(found, mesh.points):
                raise ValueError("vertices were welded")
            rig, correctives = usd_corrections.restored(found, rig)
        except (ValueError, KeyError, TypeError):
            notes.append("Its corrections contradict themselves and are left out; export the rig again.")
    return RigFile(mesh, rig, all_clips(rig), tuple(dict.fromkeys(notes)), name, metres, up, correctives)


def _to_metres(raw: RawRig, metres: float, up: str) -> RawRig:
    """All of it in metres, Y up. Z up turns by -90 degrees about X: (x, z, -y)."""
    if metres == 1.0 and up == "y":
        return raw
    turn = np.eye(4)
    if up == "z":
        turn[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    roots = (raw.parents < 0) | (raw.parents >= len(raw.names))

    def scaled(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
        out = matrices.copy()
        out[..., :3, 3] *= metres
        return out

    rest, bind = scaled(raw.rest), turn @ scaled(raw.bind)
    rest[roots] = turn @ rest[roots]
    clips = []
    for clip in raw.clips:
        moved, turned = clip.translations * metres, clip.rotations.copy()
        if up == "z":
            moved[:, roots] = moved[:, roots] @ turn[:3, :3].T
            x, y, z, w = np.moveaxis(turned[:, roots], -1, 0)
            turned[:, roots] = np.stack([x - w, y + z, z - y, w + x], axis=-1) * np.sqrt(0.5)  # after -90 about x
        clips.append(clip._replace(translations=moved, rotations=turned))
    shapes = [shape._replace(offsets=shape.offsets @ turn[:3, :3].T * metres) for shape in raw.shapes]
    polygons = raw.polygons
    if polygons is not None:
        polygons = polygons._replace(points=polygons.points @ turn[:3, :3].T * metres)
    return raw._replace(polygons=polygons, rest=rest, bind=bind, clips=tuple(clips), shapes=tuple(shapes))


def _skeleton(raw: RawRig, notes: list[str]) -> tuple[Skeleton, NDArray[np.int64]]:
    """The skeleton with parents first, and the row (J,) in it of each joint of the file."""
    count = len(raw.names)
    if len(raw.parents) != count or raw.rest.shape != (count, 4, 4) or raw.bind.shape != (count, 4, 4):
        raise UserError("its skeleton has other numbers of names, parents and matrices; export it again.")
    parents = raw.parents.copy()
    lost = parents >= count
    if lost.any():
        notes.append(f"{int(lost.sum())} joints named a parent that does not exist and became roots.")
        parents[lost] = -1
    names = _unique(raw.names, notes)
    order = parents_first(parents, names)
    row_of = np.empty(count, np.int64)
    row_of[order] = np.arange(count)
    rest, bind, up_to = raw.rest.copy(), raw.bind.copy(), np.tile(np.eye(4), (count, 1, 1))
    for joint in order.tolist():
        above = up_to[parents[joint]] if parents[joint] >= 0 else np.eye(4)
        has_bind = _usable(bind[joint]) and abs(np.linalg.det(bind[joint])) > 1e-30
        if not _usable(rest[joint]):
            if not has_bind:
                raise UserError(f"the joint {names[joint]} is nowhere, its matrices are not finite; mend it.")
            rest[joint] = np.linalg.pinv(above) @ bind[joint]
            notes.append(f"The joint {names[joint]} had no finite rest; it rests where it was bound.")
        up_to[joint] = above @ rest[joint]
        if not has_bind:
            if not _usable(up_to[joint]) or abs(np.linalg.det(up_to[joint])) < 1e-30:
                raise UserError(f"the joint {names[joint]} is scaled to nothing; give it a scale and export it again.")
            bind[joint] = up_to[joint]
            notes.append(f"The joint {names[joint]} had a bind matrix that cannot be inverted; it is bound at rest.")
    sorted_parents = np.array([row_of[p] if p >= 0 else -1 for p in parents[order]], np.int32)
    return Skeleton(
        names=tuple(names[row] for row in order), parents=freeze(sorted_parents),
        rest=freeze(rest[order].astype(np.float64)), bind=freeze(bind[order].astype(np.float64)),
    ), row_of


def _usable(matrix: NDArray[np.float64]) -> bool:
    return bool((np.abs(matrix) < LARGEST).all())  # False for NaN


def _unique(names: tuple[str, ...], notes: list[str]) -> tuple[str, ...]:
    """Printable names that differ; those that had to be changed are said."""
    seen: set[str] = set()
    out: list[str] = []
    changed = 0
    for row, name in enumerate(names):
        clean = "".join(c if c.isprintable() else "_" for c in name)[:200] or f"joint{row + 1}"
        unique, again = clean, 2
        while unique in seen:
            unique, again = f"{clean}_{again}", again + 1
        changed += unique != name
        seen.add(unique)
        out.append(unique)
    if changed:
        notes.append(f"{changed} joints got other names, because theirs were empty, unprintable or used twice.")
    return tuple(out)


def _with_still(skeleton: Skeleton) -> Skeleton:
    """The skeleton with a last joint that nothing moves."""
    name = STILL
    while name in skeleton.names:
        name += "_"
    return Skeleton(
        names=(*skeleton.names, name), parents=freeze(np.append(skeleton.parents, -1).astype(np.int32)),
        rest=freeze(np.concatenate([skeleton.rest, np.eye(4)[None]])),
        bind=freeze(np.concatenate([skeleton.bind, np.eye(4)[None]])),
    )


def _skin(
    raw: RawRig, row_of: NDArray[np.int64], joints_there: int, notes: list[str]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Joints of the sorted skeleton and weights (V, K) that sum to 1; `joints_there` is the still joint."""
    assert raw.polygons is not None
    count = len(raw.polygons.points)
    joints, weights = raw.joints, raw.weights
    if joints.shape != weights.shape or joints.shape[0] != count:
        raise UserError(f"it has weights for {weights.shape[0]} vertices and a mesh of {count}; export it again.")
    if not joints_there or not joints.shape[1]:
        return np.zeros((count, 0), np.int64), np.zeros((count, 0))
    used = np.abs(np.where(np.isfinite(weights), weights, 1.0)) > 0
    there = (joints >= 0) & (joints <= joints_there)
    wrong = int((used & ~there).sum())
    if wrong:
        notes.append(f"{wrong} weights named joints that do not exist; they are left out.")
    bad = ~np.isfinite(weights) | (weights < 0.0) | (np.abs(weights) > LARGEST)
    if (bad & there).any():
        notes.append(f"{int((bad & there).sum())} weights were negative or not finite; they are left out.")
    shares = np.where(bad | ~there, 0.0, weights)
    rows = np.where(there, np.append(row_of, joints_there)[np.where(there, joints, 0)], 0)
    total = shares.sum(axis=1)
    empty = total <= 1e-8
    if empty.any():
        root = int(rows[~empty][0, 0]) if (~empty).any() else 0
        rows[empty], shares[empty] = root, 0.0
        shares[empty, 0] = 1.0
        notes.append(f"{int(empty.sum())} vertices had no weights; they follow one joint of the skin.")
        total = np.where(empty, 1.0, total)
    off = np.abs(total - 1.0) > 1e-3
    if off.any():
        notes.append(f"The weights of {int(off.sum())} vertices did not sum to 1; they are normalised.")
    return rows, shares / total[:, None]


def _targets(raw: RawRig, notes: list[str]) -> list[RawShape]:
    """The targets that can be used: rows ascending, each once, finite, at weights apart from 0 and each other."""
    assert raw.polygons is not None
    count = len(raw.polygons.points)
    kept: list[RawShape] = []
    for shape in raw.shapes:
        rows, offsets = shape.vertices, shape.offsets
        at = shape.at
        fits = len(rows) == len(offsets) and (not len(rows) or 0 <= rows.min() <= rows.max() < count)
        clash = any(other.name == shape.name and abs(other.at - at) < LEAST_APART for other in kept)
        if not fits or clash or not np.isfinite(at) or not LEAST_APART <= abs(at) < 1e6:
            notes.append(f"A target of the blend shape {shape.name} could not be used and is left out.")
            continue
        finite = (np.abs(offsets) < LARGEST).all(axis=1)
        if not finite.all():
            notes.append(f"The blend shape {shape.name} moved {int((~finite).sum())} vertices nowhere; they stay.")
        rows, offsets = rows[finite], offsets[finite]
        order = np.argsort(rows, kind="stable")
        rows, offsets = rows[order], offsets[order]
        last = np.append(rows[1:] != rows[:-1], True)[: len(rows)]
        kept.append(shape._replace(vertices=rows[last], offsets=offsets[last]))
    place = {name: row for row, name in enumerate(dict.fromkeys(shape.name for shape in kept))}
    return sorted(kept, key=lambda shape: (place[shape.name], shape.at))


def _alike(
    joints: NDArray[np.int64], weights: NDArray[np.float64], targets: list[RawShape], dual: NDArray[np.bool_] | None,
    count: int,
) -> NDArray[np.uint64]:
    """A number (V,) for each vertex, equal for those that joints and shapes move alike: only they may be welded."""
    mixed = np.zeros(count, np.uint64)

    def add(rows: NDArray[np.int64] | slice, words: NDArray[np.uint64]) -> None:
        mixed[rows] = (mixed[rows] ^ words) * np.uint64(0x9E3779B97F4A7C15)
        mixed[rows] ^= mixed[rows] >> np.uint64(29)

    order = np.argsort(np.where(weights > 0.0, joints, joints.max(initial=0) + 1), axis=1, kind="stable")
    every = slice(None)
    for column in range(joints.shape[1]):
        row = order[:, column : column + 1]
        share = np.take_along_axis(weights, row, 1)[:, 0]
        joint = np.where(share > 0.0, np.take_along_axis(joints, row, 1)[:, 0], -1)
        add(every, joint.astype(np.uint64))
        add(every, np.round(share, 6).astype(np.float32).view(np.uint32).astype(np.uint64))
    if dual is not None:
        add(every, dual.astype(np.uint64))
    for number, target in enumerate(targets):
        moves = (target.offsets != 0.0).any(axis=1)
        rows = target.vertices[moves]
        add(rows, np.full(len(rows), number + 1, np.uint64))
        for axis in range(3):
            add(rows, (target.offsets[moves, axis] + 0.0).astype(np.float32).view(np.uint32).astype(np.uint64))
    return mixed


def _shapes(targets: list[RawShape], went: NDArray[np.int32], first: NDArray[np.int64]) -> BlendShapes | None:
    """The targets over the welded mesh: `went` (W,) its vertices, `first` (V,) the first of the file for each."""
    if not targets:
        return None
    names = tuple(dict.fromkeys(target.name for target in targets))
    keeps = np.zeros(len(went), np.bool_)
    keeps[first] = True
    rows, offsets = [], []
    for target in targets:
        mine = keeps[target.vertices] & (target.offsets.astype(np.float32) != 0.0).any(axis=1)
        rows.append(went[target.vertices[mine]].astype(np.int32))
        offsets.append(target.offsets[mine].astype(np.float32))
    return BlendShapes(
        names=names, shape=freeze(np.array([names.index(target.name) for target in targets], np.int32)),
        at=freeze(np.array([target.at for target in targets], np.float64)),
        starts=freeze(np.cumsum([0, *map(len, rows)]).astype(np.int64)),
        vertices=freeze(np.concatenate(rows)), offsets=freeze(np.concatenate(offsets)),
    )


def _controls(raw: RawRig, skeleton: Skeleton, shapes: BlendShapes | None) -> tuple[Control, ...]:
    """A dial for each shape, over all its targets, under a name no joint and no other control has."""
    made: list[Control] = []
    taken = set(skeleton.names)
    for row, name in enumerate(() if shapes is None else shapes.names):
        assert shapes is not None
        clean = "".join(c if c.isprintable() else "_" for c in name)[:200] or f"shape{row + 1}"
        unique, again = clean, 2
        while unique in taken:
            unique, again = f"{clean}_{again}", again + 1
        taken.add(unique)
        at = shapes.at[shapes.shape == row]
        rest = float(raw.rests.get(name, 0.0))
        rest = rest if np.isfinite(rest) and abs(rest) < 1e6 else 0.0
        low, high = min(0.0, rest, float(at.min())), max(1.0, rest, float(at.max()))
        made.append(Control(name=unique, rest=rest, low=low, high=high))
    return tuple(made)


def _clips(
    raw: RawRig, skeleton: Skeleton, row_of: NDArray[np.int64], renamed: dict[str, str], notes: list[str]
) -> tuple[Clip, ...]:
    made: list[Clip] = []
    order = np.argsort(row_of)
    names: set[str] = set()
    for clip in raw.clips:
        clean = "".join(c if c.isprintable() else "_" for c in clip.name)[:200] or "clip"
        unique, again = clean, 2
        while unique in names:
            unique, again = f"{clean}_{again}", again + 1
        names.add(unique)
        made.append(_clip(clip, unique, skeleton, order, renamed, notes))
    return tuple(made)


def _clip(
    clip: RawClip, name: str, skeleton: Skeleton, order: NDArray[np.int64], renamed: dict[str, str], notes: list[str]
) -> Clip:
    frames, count = len(clip.translations), len(order)
    shapes = (clip.translations.shape, clip.rotations.shape, clip.scales.shape, len(clip.numbers))
    if not frames or shapes != ((frames, count, 3), (frames, count, 4), (frames, count, 3), frames):
        raise UserError(f"the clip {name} does not fit its skeleton; export it again.")
    check_frames(name, frames, len(skeleton.names))
    t, q, s = (np.array(v, np.float64)[:, order] for v in (clip.translations, clip.rotations, clip.scales))
    wrong = ~((np.abs(t) < LARGEST).all(-1) & (np.abs(s) < LARGEST).all(-1) & np.isfinite(q).all(-1))
    wrong |= np.abs(np.nan_to_num(q)).max(axis=-1, initial=0.0) < 1e-12
    if wrong.any():
        notes.append(f"The clip {name} has {int(wrong.sum())} places that are not finite; the joints rest there.")
        for values, rest in zip((t, q, s), split_matrices(skeleton.rest[:count])[:3], strict=True):
            values[wrong] = np.broadcast_to(rest, values.shape)[wrong]
    still = len(skeleton.names) - count
    if still:
        t, s = np.pad(t, ((0, 0), (0, still), (0, 0))), np.pad(s, ((0, 0), (0, still), (0, 0)), constant_values=1.0)
        q = np.concatenate([q, np.tile([0.0, 0.0, 0.0, 1.0], (frames, still, 1))], axis=1)
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    kept = [row for row, number in enumerate(clip.number_names) if number in renamed]
    numbers = np.nan_to_num(np.clip(clip.numbers[:, kept], -1e6, 1e6))
    start = clip.start if np.isfinite(clip.start) and abs(clip.start) < 1e9 else 0.0
    rate = clip.frames_per_second if 1e-3 <= clip.frames_per_second <= 1e6 else 24.0
    return Clip(
        name=name, start=float(start), frames_per_second=float(rate), translations=freeze(t.astype(np.float32)),
        rotations=freeze(without_flips(q).astype(np.float32)), scales=freeze(s.astype(np.float32)),
        number_names=tuple(renamed[clip.number_names[row]] for row in kept),
        numbers=freeze(numbers.astype(np.float32)) if kept else None,
    )
