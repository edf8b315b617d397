"""Rigs of glTF 2.0: skins of any number of influences, morph targets, animations. Nodes of skins become joints.

A frame is a second times the frame rate at which the keys of the first animation lie on whole frames (24 where there is
none); all clips of a file have that rate.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.gltf import (
    FAN,
    MOST_CORNERS,
    MOST_PIECES,
    STRIP,
    TRIANGLES,
    Animation,
    Gltf,
    Node,
    Primitive,
    Sampler,
    checked_row,
    local_matrix,
    open_gltf,
    placed_nodes,
    read_primitive,
)
from core.formats.gltf_accessors import read_accessor
from core.formats.mesh_pieces import unique_names
from core.formats.rig_parts import (
    RawClip,
    RawRig,
    RawShape,
    RigPiece,
    Targets,
    bind_skins,
    join_pieces,
    parents_first,
)
from core.pose.clip import check_frames, rate_of, split_matrices
from core.transform import compose, normalized, quaternion_product, slerp

Array = NDArray[np.float64]
MOST_POINTS = 20_000_000  # of a rig; its weights are held in double precision while it is read
MOST_SETS = 64  # of four influences
MOST_TARGETS = 4096  # of one mesh
PATHS = {"translation": 3, "rotation": 4, "scale": 3}


class _Tree(NamedTuple):
    """The nodes that become joints.

    above_node : (N,) the node above each, -1 for none; no loops above a node of the scene.
    joint_of_node : (N,) row of each node among the joints, -1 for a node that is none.
    nodes : (J,) rows of the nodes. parents : (J,) rows among joints.
    above : (J, 4, 4) what lies between a joint and its parent and never moves, without its uniform scale.
    scales : (J,) uniform scale of all that never moves above a joint: it is taken into the translations.
    world : (J, 4, 4) where the joints rest, in the scene. rest : (J, 4, 4) parent_from_joint.
    """

    above_node: NDArray[np.int64]
    joint_of_node: NDArray[np.int64]
    nodes: list[int]
    parents: NDArray[np.int64]
    above: Array
    scales: Array
    world: Array
    rest: Array


class GltfFile(NamedTuple):
    """What a file says, and its buffers."""

    path: Path
    gltf: Gltf
    buffers: list[bytes]

    def numbers(self, row: int, width: int) -> Array:
        return read_accessor(self.gltf.accessors[checked_row(row)], self.gltf.buffer_views, self.buffers, width)


def read_raw(path: Path) -> RawRig:
    """Skeleton, skins, morph targets and animations of the scene, metres, Y up.

    Raises
    ------
    UserError
        As for meshes, and for skins or animations that contradict themselves.
    """
    gltf, buffers = open_gltf(path)
    file = GltfFile(path, gltf, buffers)
    try:
        with np.errstate(all="ignore"):
            return _read(file)
    except (IndexError, ValueError, OverflowError) as error:
        raise UserError(f"{path.name} contradicts itself ({error}); export it again.") from None


def _read(file: GltfFile) -> RawRig:
    notes: list[str] = []
    placed = placed_nodes(file.path, file.gltf)
    tree = _tree(file, dict(placed))
    names = [file.gltf.nodes[row].name or f"node{row}" for row in tree.nodes]
    bound = bind_skins(tree.parents, tree.world, tree.scales, _skins(file, tree), notes)
    extra = bound.same_as  # joints bound in two places: further ones that move with them
    names += [f"{names[j]} (bound again)" for j in extra]
    parents = np.concatenate([tree.parents, np.array(extra, np.int64)])
    rest = np.concatenate([tree.rest, np.tile(np.eye(4), (len(extra), 1, 1))])
    pieces, rests, shapes_of_node = _meshes(file, placed, tree, bound.skins, bound.bind, len(names))
    clips = _clips(file, tree, len(extra), shapes_of_node, notes)
    polygons, joints, weights = None, np.zeros((0, 0), np.int64), np.zeros((0, 0))
    shapes: tuple[RawShape, ...] = ()
    if pieces:
        parts = unique_names([p.polygons for p in pieces])
        polygons, joints, weights, shapes = join_pieces([
            piece._replace(polygons=part) for piece, part in zip(pieces, parts, strict=True)
        ])
    return RawRig(
        polygons, tuple(names), parents, rest, bound.bind, joints, weights, shapes, rests, tuple(clips), "linear", 1.0,
        "y", tuple(notes),
    )  # fmt: skip


def _tree(file: GltfFile, placed: dict[int, Array]) -> _Tree:
    gltf = file.gltf
    count = len(gltf.nodes)
    above_node = np.full(count, -1, np.int64)
    for row in [*(set(range(count)) - set(placed)), *placed]:  # the scene has the last word
        for child in gltf.nodes[row].children:
            above_node[checked_row(child)] = row
    wanted = {checked_row(j) for skin in gltf.skins for j in skin.joints}
    if any(j >= count for j in wanted):
        raise UserError(f"{file.path.name} has a skin whose joint does not exist; export it again.")
    moving = {
        channel.target.node for animation in gltf.animations for channel in animation.channels
        if channel.target.path in PATHS and channel.target.node is not None
    }
    carriers = wanted | {row for row, node in enumerate(gltf.nodes) if node.mesh is not None and row in placed}
    reached: set[int] = set()
    for row in carriers:  # every animated node above a joint or a mesh moves it
        at, steps = row, 0
        while at >= 0 and at not in reached and steps <= count:
            reached.add(at)
            at, steps = int(above_node[at]), steps + 1
        if steps > count:
            raise UserError(f"{file.path.name} has nodes that contain themselves; export it again.")
    joint_nodes = wanted | (reached & {n for n in moving if n is not None})
    order: list[int] = [row for row in placed if row in joint_nodes]
    order += sorted(joint_nodes - set(order))
    joint_of_node = np.full(count, -1, np.int64)
    joint_of_node[order] = np.arange(len(order))
    parents, own = np.full(len(order), -1, np.int64), np.ones(len(order))
    above = np.tile(np.eye(4), (len(order), 1, 1))
    for j, row in enumerate(order):
        at, steps = int(above_node[row]), 0
        while at >= 0 and joint_of_node[at] < 0:
            above[j] = local_matrix(gltf.nodes[at]) @ above[j]
            at, steps = int(above_node[at]), steps + 1
            if steps > count:
                raise UserError(f"{file.path.name} has nodes that contain themselves; export it again.")
        parents[j] = joint_of_node[at] if at >= 0 else -1
        size = np.linalg.norm(above[j, :3, :3], axis=0)
        square = above[j, :3, :3].T @ above[j, :3, :3]
        if size.min() > 1e-12 and np.abs(square - np.eye(3) * size[0] ** 2).max() < 1e-6 * size[0] ** 2:
            own[j] = size[0] if abs(size[0] - 1.0) > 1e-9 else 1.0
            above[j, :3, :3] /= own[j]
    world, scales = np.tile(np.eye(4), (len(order), 1, 1)), np.ones(len(order))
    rest = world.copy()
    for j in parents_first(parents, [gltf.nodes[row].name or f"node{row}" for row in order]).tolist():
        upper = scales[parents[j]] if parents[j] >= 0 else 1.0
        scales[j] = upper * own[j]
        local = local_matrix(gltf.nodes[order[j]])
        rest[j] = _under(above[j], upper, own[j], local)
        over = world[parents[j]] if parents[j] >= 0 else np.eye(4)
        grown = above[j].copy()
        grown[:3, :3] *= own[j]
        world[j] = over @ grown @ local
    return _Tree(above_node, joint_of_node, order, parents, above, scales, world, rest)


def _under(above: Array, upper: float, own: float, local: Array) -> Array:
    """parent_from_joint (..., 4, 4) of local matrices under what never moves, uniform scale in the translations."""
    moved = local.copy()
    moved[..., :3, 3] *= own
    out = above @ moved
    out[..., :3, 3] *= upper
    return out


def _skins(file: GltfFile, tree: _Tree) -> list[tuple[NDArray[np.int64], Array]]:
    """Per skin its joints (K,) and its inverse bind matrices (K, 4, 4)."""
    skins = []
    for skin in file.gltf.skins:
        rows = tree.joint_of_node[np.array(skin.joints, np.int64)]
        inverse = np.tile(np.eye(4), (len(rows), 1, 1))
        if skin.inverse_bind_matrices is not None:
            inverse = file.numbers(skin.inverse_bind_matrices, 16).reshape(-1, 4, 4).swapaxes(1, 2)
            if len(inverse) < len(rows):
                raise UserError(
                    f"{file.path.name} has {len(inverse)} bind matrices for {len(rows)} joints of a skin; "
                    "export it again."
                )
        skins.append((rows, inverse[: len(rows)]))
    return skins


def _meshes(
    file: GltfFile, placed: list[tuple[int, Array]], tree: _Tree, skins: list[tuple[NDArray[np.int64], Array]],
    bind: Array, joints: int,
) -> tuple[list[RigPiece], dict[str, float], dict[int, list[str]]]:
    """The meshes of the scene, rests of their shapes by name, and the names of the shapes of each node."""
    gltf, still = file.gltf, joints
    pieces: list[RigPiece] = []
    rests: dict[str, float] = {}
    names_of_node: dict[int, list[str]] = {}
    taken: set[str] = set()
    points = corners = 0
    for row, world in placed:
        node = gltf.nodes[row]
        if node.mesh is None:
            continue
        source = gltf.meshes[checked_row(node.mesh)]
        if len(pieces) + len(source.primitives) > MOST_PIECES:
            raise UserError(f"{file.path.name} shows more than {MOST_PIECES:,} pieces; join them before the export.")
        name = node.name or source.name or "mesh"
        transform, carrier, table = world, _carrier(tree, row), None
        if node.skin is not None:
            table, transform = skins[checked_row(node.skin)]
        elif carrier >= 0:
            scale = np.diag([tree.scales[carrier]] * 3 + [1.0])
            transform = bind[carrier] @ scale @ np.linalg.inv(tree.world[carrier]) @ world
        wanted = max((len(primitive.targets) for primitive in source.primitives), default=0)
        if wanted > MOST_TARGETS:
            raise UserError(f"{file.path.name} has a mesh with more than {MOST_TARGETS:,} morph targets.")
        shapes = _shape_names(source.extras, wanted, name, taken)
        names_of_node[row] = shapes
        taken |= set(shapes)
        rests |= {shape: float(at) for shape, at in zip(shapes, node.weights or source.weights) if at}
        for primitive in source.primitives:
            if primitive.mode not in (TRIANGLES, STRIP, FAN) or "POSITION" not in primitive.attributes:
                continue
            piece = read_primitive(gltf, file.buffers, primitive, transform, name)
            points, corners = points + len(piece.points), corners + len(piece.corners)
            if corners > MOST_CORNERS or points > MOST_POINTS:
                raise UserError(f"{file.path.name} shows more than {MOST_POINTS:,} vertices; export a smaller mesh.")
            if not len(piece.counts):
                continue
            count = len(piece.points)
            if table is not None:
                rows, weights = _influences(file, primitive, table, count)
            else:
                rows = np.full((count, 1 if still else 0), carrier if carrier >= 0 else still, np.int64)
                weights = np.ones(rows.shape)
            targets = _targets(file, primitive, shapes, transform, count)
            pieces.append(RigPiece(piece, rows, weights, targets))
    return pieces, rests, names_of_node


def _carrier(tree: _Tree, row: int) -> int:
    """The joint an unskinned node hangs on: itself or the first joint above it, -1 for none."""
    while row >= 0 and tree.joint_of_node[row] < 0:
        row = int(tree.above_node[row])
    return int(tree.joint_of_node[row]) if row >= 0 else -1


def _shape_names(extras: Any, count: int, mesh: str, taken: set[str]) -> list[str]:
    given = extras.get("targetNames") if isinstance(extras, dict) else None
    names: list[str] = []
    for row in range(count):
        name = given[row] if isinstance(given, list) and row < len(given) and isinstance(given[row], str) else ""
        name = name[:200] or f"target{row + 1}"
        if name in taken or name in names:
            name = f"{mesh} {name}"[:200]
        unique, again = name, 2
        while unique in taken or unique in names:
            unique, again = f"{name} {again}", again + 1
        names.append(unique)
    return names


def _influences(
    file: GltfFile, primitive: Primitive, table: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], Array]:
    """Joints and weights (V, 4 x sets) of a primitive; -1 for a joint its skin does not have."""
    joints, weights = [], []
    for number in range(MOST_SETS):
        at, share = (primitive.attributes.get(f"{word}_{number}") for word in ("JOINTS", "WEIGHTS"))
        if at is None or share is None:
            break
        rows, shares = file.numbers(at, 4), file.numbers(share, 4)
        if len(rows) != count or len(shares) != count:
            raise UserError(f"{file.path.name} has {len(shares)} weights for {count} vertices; export it again.")
        inside = (rows >= 0) & (rows < len(table))
        local = np.where(inside, rows, 0).astype(np.int64)
        joints.append(np.where(inside, table[local] if len(table) else -1, -1))
        weights.append(shares)
    if not joints:
        return np.zeros((count, 1), np.int64), np.zeros((count, 1))
    return np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)


def _targets(
    file: GltfFile, primitive: Primitive, names: list[str], transform: Array, count: int
) -> dict[str, Targets]:
    found: dict[str, Targets] = {}
    for name, target in zip(names, primitive.targets):
        if "POSITION" in target:
            offsets = file.numbers(target["POSITION"], 3)
            if len(offsets) != count:
                raise UserError(
                    f"{file.path.name} has a morph target of {len(offsets)} vertices for {count}; export it again."
                )
            rows = np.flatnonzero((offsets != 0.0).any(axis=1))
            found[name] = {1.0: (rows, offsets[rows] @ transform[:3, :3].T)}
        else:
            found[name] = {1.0: (np.zeros(0, np.int64), np.zeros((0, 3)))}
    return found


def _clips(
    file: GltfFile, tree: _Tree, aliases: int, shapes_of_node: dict[int, list[str]], notes: list[str]
) -> list[RawClip]:
    made: list[RawClip] = []
    for number, animation in enumerate(file.gltf.animations):
        name = animation.name or f"clip{number + 1}"
        rate = made[0].frames_per_second if made else None
        clip = _clip(file, animation, tree, aliases, shapes_of_node, name, rate, notes)
        if clip is not None:
            made.append(clip)
    return made


def _clip(
    file: GltfFile, animation: Animation, tree: _Tree, aliases: int, shapes_of_node: dict[int, list[str]], name: str,
    wanted: float | None, notes: list[str],
) -> RawClip | None:
    channels = []
    for channel in animation.channels:
        sampler = animation.samplers[checked_row(channel.sampler)]
        node, path = channel.target.node, channel.target.path
        if node is None or path not in (*PATHS, "weights"):
            continue
        if (path == "weights" and not shapes_of_node.get(node)) or (
            path != "weights" and tree.joint_of_node[checked_row(node)] < 0
        ):
            continue
        seconds = file.numbers(sampler.input, 1)[:, 0]
        if len(seconds) and np.isfinite(seconds).all() and (np.diff(seconds) >= 0).all():
            channels.append((node, path, sampler, seconds))
        else:
            notes.append(f"A channel of the clip {name} has keys out of order and is left out.")
    if not channels:
        return None
    keys = np.concatenate([seconds for *_, seconds in channels])
    rate = rate_of(keys) if wanted is None else wanted
    first, last = np.floor(keys.min() * rate + 1e-3), np.ceil(keys.max() * rate - 1e-3)
    if max(abs(first), abs(last)) > 1e9:
        raise UserError(f"{file.path.name} has a clip {name} that lasts too long; export a part of it.")
    joints = len(tree.nodes)
    check_frames(name, int(last - first) + 1, joints)
    frames = np.arange(first, last + 0.5)
    at = frames / rate
    values: dict[tuple[int, str], Array] = {}
    for node, path, sampler, seconds in channels:
        width = len(shapes_of_node[node]) if path == "weights" else PATHS[path]
        values[node, path] = sampled(file, sampler, seconds, at, width, path == "rotation", 0.05 / rate)
    t, q, s = (np.zeros((len(frames), joints, width)) for width in (3, 4, 3))
    for j, row in enumerate(tree.nodes):
        mine = [values.get((row, path)) for path in PATHS]
        rest_t, rest_q, rest_s = _parts(file.gltf.nodes[row])
        local = [np.broadcast_to(rest, (len(frames), len(rest))) if v is None else v
                 for v, rest in zip(mine, (rest_t, rest_q, rest_s))]
        upper = tree.scales[tree.parents[j]] if tree.parents[j] >= 0 else 1.0
        own = tree.scales[j] / upper
        above = tree.above[j]
        turn = above[:3, :3]
        if np.abs(turn @ turn.T - np.eye(3)).max() < 1e-9 and np.linalg.det(turn) > 0:
            t[:, j] = upper * (own * local[0] @ turn.T + above[:3, 3])
            q[:, j] = quaternion_product(split_matrices(above)[1], normalized(local[1]))
            s[:, j] = local[2]
        else:
            matrices = _under(above, upper, own, compose(*local))
            t[:, j], q[:, j], s[:, j], lost = split_matrices(matrices)
            if lost > 1e-4:
                notes.append(f"The clip {name} shears the joint {file.gltf.nodes[row].name}; the shear is left out.")
    t = np.pad(t, ((0, 0), (0, aliases), (0, 0)))
    q = np.concatenate([q, np.tile([0.0, 0.0, 0.0, 1.0], (len(frames), aliases, 1))], axis=1)
    s = np.pad(s, ((0, 0), (0, aliases), (0, 0)), constant_values=1.0)
    columns = {
        shape: values[node, "weights"][:, k] for node, path in values if path == "weights"
        for k, shape in enumerate(shapes_of_node[node])
    }
    numbers = np.stack(list(columns.values()), 1) if columns else np.zeros((len(frames), 0))
    return RawClip(name, float(first), rate, t, q, s, tuple(columns), numbers)


def _parts(node: Node) -> tuple[Array, Array, Array]:
    """Translation, rotation and scale of a node at rest."""
    if node.matrix is not None:
        t, q, s, _ = split_matrices(local_matrix(node))
        return t, q, s
    return np.array(node.translation), normalized(node.rotation), np.array(node.scale)


def sampled(
    file: GltfFile, sampler: Sampler, seconds: Array, at: Array, width: int, turns: bool, near: float
) -> Array:
    """Values (F, width) of a sampler at seconds `at` (F,), held outside its keys; keys within `near` are met."""
    cubic = sampler.interpolation == "CUBICSPLINE"
    each = width * (3 if cubic else 1)
    if turns or width in (3, 4):
        accessor = file.gltf.accessors[checked_row(sampler.output)]
        wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}.get(accessor.type, 0)
    else:
        wide = 1
    if not wide:
        raise ValueError("an animation has values of a type that does not fit its use")
    flat = file.numbers(sampler.output, wide).reshape(-1)
    if len(flat) != len(seconds) * each:
        raise ValueError(f"an animation has {len(flat)} values where {len(seconds) * each} are needed")
    keys = flat.reshape(len(seconds), 3 if cubic else 1, width)
    at = np.clip(at, seconds[0], seconds[-1])
    closest = np.clip(np.searchsorted(seconds, at), 0, len(seconds) - 1)
    for other in (closest, np.maximum(closest - 1, 0)):
        at = np.where(np.abs(seconds[other] - at) < near, seconds[other], at)
    low = np.clip(np.searchsorted(seconds, at, side="right") - 1, 0, len(seconds) - 1)
    high = np.minimum(low + 1, len(seconds) - 1)
    span = seconds[high] - seconds[low]
    part = np.where(span > 0.0, (at - seconds[low]) / np.where(span > 0.0, span, 1.0), 0.0)
    middle = 1 if cubic else 0
    before, after = keys[low, middle], keys[high, middle]
    if sampler.interpolation == "STEP":
        out = before
    elif cubic:
        p, d = part[:, None], span[:, None]
        out = (
            (2 * p**3 - 3 * p**2 + 1) * before + d * (p**3 - 2 * p**2 + p) * keys[low, 2]
            + (3 * p**2 - 2 * p**3) * after + d * (p**3 - p**2) * keys[high, 0]
        )
    elif turns:
        out = slerp(before, after, part)
    else:
        out = before + part[:, None] * (after - before)
    return normalized(out) if turns else out
