"""What a reader of rigs hands over, before anything is believed; and the way from a child process back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.mesh_pieces import join
from core.mesh.polygons import Polygons

Targets = dict[float, tuple[NDArray[np.int64], NDArray[np.float64]]]  # by weight: rows and what they are moved by


class RawClip(NamedTuple):
    """Motion on every frame: (F, J, 3), (F, J, 4), (F, J, 3) as in ``Clip``, units of the file; numbers (F, N)."""

    name: str
    start: float
    frames_per_second: float
    translations: NDArray[np.float64]
    rotations: NDArray[np.float64]
    scales: NDArray[np.float64]
    number_names: tuple[str, ...]
    numbers: NDArray[np.float64]


class RawShape(NamedTuple):
    """One target: name of its shape, weight at which it is reached, rows and offsets, units of the file."""

    name: str
    at: float
    vertices: NDArray[np.int64]
    offsets: NDArray[np.float64]


class RawSculpts(NamedTuple):
    """Corrections as ``core.formats.usd_corrections`` wrote them: JSON, and arrays by name."""

    said: str
    arrays: Mapping[str, NDArray[Any]]


class RawRig(NamedTuple):
    """A rig as it stands in a file, units and axes of the file.

    polygons : all meshes; None when the file has only a skeleton.
    names, parents, rest, bind : as in ``Skeleton``; parents in any order, any values.
    joints, weights : (V, K) of the vertices, any values.
    rests : where shapes rest that do not rest at 0.
    skinning, dual : as of ``Rig``.
    """

    polygons: Polygons | None
    names: tuple[str, ...]
    parents: NDArray[np.int64]
    rest: NDArray[np.float64]
    bind: NDArray[np.float64]
    joints: NDArray[np.int64]
    weights: NDArray[np.float64]
    shapes: tuple[RawShape, ...] = ()
    rests: Mapping[str, float] = {}
    clips: tuple[RawClip, ...] = ()
    skinning: Literal["linear", "dual-quaternion", "mixed"] = "linear"
    metres_per_unit: float | None = None
    up: str | None = None
    notes: tuple[str, ...] = ()
    sculpts: RawSculpts | None = None
    dual: NDArray[np.bool_] | None = None


class RigPiece(NamedTuple):
    """One mesh of a file: (V, K) joints and weights, and the targets of its shapes by name.

    dual : (V,) which vertices are skinned by dual quaternions, None for none.
    """

    polygons: Polygons
    joints: NDArray[np.int64]
    weights: NDArray[np.float64]
    shapes: dict[str, Targets]
    dual: NDArray[np.bool_] | None = None


def join_pieces(
    pieces: Sequence[RigPiece],
) -> tuple[Polygons, NDArray[np.int64], NDArray[np.float64], tuple[RawShape, ...]]:
    """All pieces as one mesh; a shape of one name moves all pieces that have it."""
    wide = max((p.joints.shape[1] for p in pieces), default=0)
    joints = np.concatenate([_widened(p.joints, wide) for p in pieces])
    weights = np.concatenate([_widened(p.weights, wide) for p in pieces])
    starts = np.cumsum([0, *(len(p.polygons.points) for p in pieces)])
    names = list(dict.fromkeys(name for p in pieces for name in p.shapes))
    targets: list[RawShape] = []
    for name in names:
        mine = [(start, p.shapes[name]) for start, p in zip(starts, pieces) if p.shapes.get(name)]
        for at in sorted({at for _, shape in mine for at in shape}):
            moved = [(start, *_target_at(shape, at)) for start, shape in mine]
            rows = np.concatenate([start + rows for start, rows, _ in moved])
            targets.append(RawShape(name, at, rows, np.concatenate([offsets for _, _, offsets in moved])))
    return join([p.polygons for p in pieces]), joints, weights, tuple(targets)


def _target_at(shape: Targets, at: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """What a shape does at a weight, from its own targets: straight lines through them and nothing at 0."""
    if at in shape:
        return shape[at]
    stops = sorted({*shape, 0.0})
    high = min(max(int(np.searchsorted(stops, at)), 1), len(stops) - 1)
    part = (at - stops[high - 1]) / (stops[high] - stops[high - 1])
    rows, offsets = [], []
    for stop, share in ((stops[high - 1], 1.0 - part), (stops[high], part)):
        if stop in shape:
            rows.append(shape[stop][0])
            offsets.append(share * shape[stop][1])
    every, back = np.unique(np.concatenate(rows), return_inverse=True)
    total = np.zeros((len(every), 3))
    np.add.at(total, back.ravel(), np.concatenate(offsets))
    return every, total


def _widened(rows: NDArray[Any], columns: int) -> NDArray[Any]:
    return np.pad(rows, ((0, 0), (0, columns - rows.shape[1])))


def parents_first(parents: NDArray[np.int64], names: Sequence[str]) -> NDArray[np.int64]:
    """Rows (J,) of joints in an order where parents come first, as close to their own order as may be.

    Raises
    ------
    UserError
        When a joint is its own ancestor.
    """
    order: list[int] = []
    placed = np.zeros(len(parents), np.bool_)
    for joint in range(len(parents)):
        chain: list[int] = []
        at, waiting = joint, set()
        while at >= 0 and not placed[at]:
            if at in waiting:
                raise UserError(f"The joint {names[at]} is its own ancestor; mend its parents and export it again.")
            waiting.add(at)
            chain.append(at)
            at = int(parents[at])
        for row in reversed(chain):
            placed[row] = True
            order.append(row)
    return np.array(order, np.int64)


def concatenated(local: NDArray[np.float64], parents: NDArray[np.int64]) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) of joints over all their ancestors; parents in any order, without cycles."""
    out = local.copy()
    for joint in parents_first(parents, [str(row) for row in range(len(parents))]):
        if parents[joint] >= 0:
            out[joint] = out[parents[joint]] @ out[joint]
    return out


def rest_from_bind(bind_root: NDArray[np.float64], rest_root: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the skin lies that was bound at `bind_root` when that joint rests at `rest_root`: (4, 4)."""
    if not np.isfinite(bind_root).all() or abs(np.linalg.det(bind_root)) < 1e-30:
        return np.eye(4)
    moved = rest_root @ np.linalg.inv(bind_root)
    size = max(float(np.abs(rest_root[:3, 3]).max()), 1.0)
    near = np.abs(moved[:3, :3] - np.eye(3)).max() < 1e-5 and np.abs(moved[:3, 3]).max() < 1e-5 * size
    return np.eye(4) if near or not np.isfinite(moved).all() or abs(np.linalg.det(moved)) < 1e-30 else moved


class Bound(NamedTuple):
    """Where joints were bound.

    bind : (J + A, 4, 4), further joints last. same_as : (A,) the joint each further one moves with.
    skins : of each its joints (K,) and what its points are moved by (4, 4) before they are bound.
    """

    bind: NDArray[np.float64]
    same_as: list[int]
    skins: list[tuple[NDArray[np.int64], NDArray[np.float64]]]


def bind_skins(
    parents: NDArray[np.int64], world: NDArray[np.float64], scales: NDArray[np.float64],
    skins: Sequence[tuple[NDArray[np.int64], NDArray[np.float64]]], notes: list[str],
) -> Bound:
    """One bind matrix for each joint, from skins that each say their own.

    The points of a skin are moved to where its root rests. A joint that two skins bind in places that cannot be brought
    together gets a further joint that moves with it.

    Parameters
    ----------
    world : (J, 4, 4) where the joints rest. scales : (J,) uniform scale to be taken out of them.
    skins : joints (K,) and inverse bind matrices (K, 4, 4) of each.
    """
    count = len(parents)
    shrunk = np.tile(np.eye(4), (count, 1, 1))
    shrunk[:, [0, 1, 2], [0, 1, 2]] = 1.0 / scales[:, None]
    bind = world @ shrunk
    depth = np.zeros(count, np.int64)
    for joint in parents_first(parents, [str(row) for row in range(count)]):
        depth[joint] = depth[parents[joint]] + 1 if parents[joint] >= 0 else 0
    bound = np.zeros(count, np.bool_)
    more: list[tuple[int, NDArray[np.float64]]] = []
    found: list[tuple[NDArray[np.int64], NDArray[np.float64]]] = []
    for rows, given in skins:
        inverse = given.copy()
        sound = np.isfinite(inverse).all((1, 2)) & (np.abs(np.linalg.det(np.nan_to_num(inverse))) > 1e-30)
        if not sound.all():
            notes.append(f"A skin has {int((~sound).sum())} bind matrices that cannot be used; bound at rest.")
            inverse[~sound] = np.linalg.pinv(world[rows[~sound]])
        places = np.linalg.inv(inverse) @ shrunk[rows]
        shared = np.flatnonzero(bound[rows])
        moved = np.eye(4)
        if len(shared):
            moved = bind[rows[shared[0]]] @ np.linalg.inv(places[shared[0]])
        elif len(rows):
            top = int(np.argmin(depth[rows]))
            moved = rest_from_bind(places[top], bind[rows[top]])
        own = moved @ places
        table = rows.copy()
        for k, joint in enumerate(rows.tolist()):
            if not bound[joint]:
                bind[joint], bound[joint] = own[k], True
            elif np.abs(bind[joint] - own[k]).max() > 1e-4 * max(float(np.abs(own[k]).max()), 1e-30):
                table[k] = count + len(more)
                more.append((joint, own[k]))
        found.append((table, moved))
    bind = np.concatenate([bind, *(matrix[None] for _, matrix in more)])
    return Bound(bind, [joint for joint, _ in more], found)


def pack_rig(raw: RawRig) -> dict[str, Any]:
    """What a child process may answer; see :func:`unpack_rig`."""
    answer: dict[str, Any] = {
        "names": list(raw.names), "parents": raw.parents, "rest": raw.rest, "bind": raw.bind, "joints": raw.joints,
        "weights": raw.weights, "rests": dict(raw.rests), "skinning": raw.skinning,
        "metres_per_unit": raw.metres_per_unit, "up": raw.up, "notes": list(raw.notes),
        "shape_names": [s.name for s in raw.shapes], "shape_at": [s.at for s in raw.shapes],
        "clip_heads": [[c.name, c.start, c.frames_per_second, list(c.number_names)] for c in raw.clips],
        "meshes": raw.polygons is not None,
    }  # fmt: skip
    if raw.polygons is not None:
        for field in ("points", "counts", "corners", "parts", "uvs"):
            if getattr(raw.polygons, field) is not None:
                answer[field] = getattr(raw.polygons, field)
        answer["part_names"] = list(raw.polygons.part_names)
    for row, shape in enumerate(raw.shapes):
        answer |= {f"shape{row}_vertices": shape.vertices, f"shape{row}_offsets": shape.offsets}
    for row, clip in enumerate(raw.clips):
        for field in ("translations", "rotations", "scales", "numbers"):
            answer[f"clip{row}_{field}"] = getattr(clip, field)
    if raw.dual is not None:
        answer["dual"] = raw.dual
    if raw.sculpts is not None:
        answer["sculpts"] = raw.sculpts.said
        answer |= {f"sculpts {name}": array for name, array in raw.sculpts.arrays.items()}
    return answer


def unpack_rig(answer: dict[str, Any]) -> RawRig:
    """The rig of an answer of :func:`pack_rig`."""
    polygons = None
    if answer["meshes"]:
        polygons = Polygons(
            answer["points"], answer["counts"], answer["corners"], answer.get("uvs"), answer["parts"],
            tuple(answer["part_names"]),
        )  # fmt: skip
    shapes = [
        RawShape(name, at, answer[f"shape{row}_vertices"], answer[f"shape{row}_offsets"])
        for row, (name, at) in enumerate(zip(answer["shape_names"], answer["shape_at"], strict=True))
    ]
    clips = [
        RawClip(
            name, start, rate, answer[f"clip{row}_translations"], answer[f"clip{row}_rotations"],
            answer[f"clip{row}_scales"], tuple(numbers), answer[f"clip{row}_numbers"],
        )
        for row, (name, start, rate, numbers) in enumerate(answer["clip_heads"])
    ]  # fmt: skip
    sculpts = None
    if "sculpts" in answer:
        arrays = {key.removeprefix("sculpts "): value for key, value in answer.items() if key.startswith("sculpts ")}
        sculpts = RawSculpts(answer["sculpts"], arrays)
    return RawRig(
        polygons, tuple(answer["names"]), answer["parents"], answer["rest"], answer["bind"], answer["joints"],
        answer["weights"], tuple(shapes), answer["rests"], tuple(clips), answer["skinning"],
        answer["metres_per_unit"], answer["up"], tuple(answer["notes"]), sculpts, answer.get("dual"),
    )  # fmt: skip
