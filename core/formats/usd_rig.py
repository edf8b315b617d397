"""Rigs of OpenUSD stages: UsdSkel skeletons, skins, blend shapes and clips. The reader runs in a bounded child process.

Every SkelAnimation of the stage is a clip, frames are time codes. A mesh lies where its root joint rests.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats import usd_corrections
from core.formats.mesh_pieces import unique_names
from core.formats.rig_parts import (
    RawClip,
    RawRig,
    RawShape,
    RigPiece,
    Targets,
    concatenated,
    join_pieces,
    pack_rig,
    rest_from_bind,
)
from core.formats.usd_mesh import mesh_piece
from core.formats.usd_skel_write import DUAL
from core.formats.usd_stage import open_stage
from core.pose.clip import check_frames, split_matrices

Array = NDArray[np.float64]


class _Skel(NamedTuple):
    """A skeleton of the stage: tokens of its joints, where they begin among all, its space and its animation."""

    query: Any
    tokens: tuple[str, ...]
    first: int
    parents: NDArray[np.int64]
    rest: Array  # (J, 4, 4) parent_from_joint, authored space
    bind: Array
    world: Array  # world_from_skeleton
    scale: float  # uniform part of `world`, taken into the translations
    object_from_bind: Array

    def local(self, authored: Array) -> Array:
        """(..., J, 4, 4) authored local matrices in the space of the stage, with uniform scale in the translations."""
        out = authored.copy()
        out[..., :3, 3] *= self.scale
        roots = self.parents < 0
        shrunk = np.diag([1 / self.scale] * 3 + [1.0])
        out[..., roots, :, :] = (self.world @ shrunk) @ out[..., roots, :, :]
        return out


def read_in_child(path: str) -> dict[str, Any]:
    """Skeletons, skins, blend shapes and clips of the stage, in its units and axes (see ``pack_rig``)."""
    from pxr import UsdGeom

    stage = open_stage(path)
    said = stage.HasAuthoredMetadata
    notes: list[str] = []
    bound, skels = _bindings(stage, notes)
    pieces = _meshes(stage, bound, skels, notes)
    names = _names([token for skel in skels for token in skel.tokens])
    clips = _clips(stage, skels, {n for p in pieces for n in p.shapes})
    polygons, joints, weights = None, np.zeros((0, 0), np.int64), np.zeros((0, 0))
    shapes: tuple[RawShape, ...] = ()
    if pieces:
        renamed = unique_names([p.polygons for p in pieces])
        polygons, joints, weights, shapes = join_pieces([
            piece._replace(polygons=polygon) for piece, polygon in zip(pieces, renamed, strict=True)
        ])  # fmt: skip
    skinning, dual = _skinning(pieces)

    def stacked(parts: list[Array]) -> Array:
        return np.concatenate([np.zeros((0, 4, 4)), *parts])

    return pack_rig(RawRig(
        polygons, names,
        np.concatenate([np.zeros(0, np.int64), *(np.where(s.parents < 0, -1, s.parents + s.first) for s in skels)]),
        stacked([s.local(s.rest) for s in skels]),
        stacked([s.object_from_bind @ s.bind @ np.diag([1 / s.scale] * 3 + [1.0]) for s in skels]),
        joints, weights, shapes, {}, tuple(clips),
        skinning,
        float(UsdGeom.GetStageMetersPerUnit(stage)) if said("metersPerUnit") else None,
        str(UsdGeom.GetStageUpAxis(stage)).lower() if said("upAxis") else None, tuple(notes),
        usd_corrections.read(stage), dual,
    ))  # fmt: skip


def _bindings(stage: Any, notes: list[str]) -> tuple[dict[str, tuple[int, Any]], list[_Skel]]:
    """Skinning query and row of the skeleton of every bound mesh by path, and the skeletons."""
    from pxr import Usd, UsdSkel

    cache = UsdSkel.Cache()
    flag = Usd.TraverseInstanceProxies()
    bound: dict[str, tuple[int, Any]] = {}
    rows: dict[str, int] = {}
    skels: list[_Skel] = []

    def row_of(skeleton: Any) -> int:
        path = str(skeleton.GetPath())
        if path not in rows:
            rows[path] = len(skels)
            skels.append(_skel(cache, skeleton, sum(len(s.tokens) for s in skels), notes))
        return rows[path]

    roots = [UsdSkel.Root(prim) for prim in stage.Traverse(flag) if prim.IsA(UsdSkel.Root)]
    for root in roots:
        cache.Populate(root, flag)
    for prim in stage.Traverse(flag):  # in the order of the stage, those that carry no skin too
        if prim.IsA(UsdSkel.Skeleton):
            row_of(UsdSkel.Skeleton(prim))
    for root in roots:
        for binding in cache.ComputeSkelBindings(root, flag):
            row = row_of(binding.GetSkeleton())
            for target in binding.GetSkinningTargets():
                bound.setdefault(str(target.GetPrim().GetPath()), (row, target))
    return bound, skels


def _skel(cache: Any, skeleton: Any, first: int, notes: list[str]) -> _Skel:
    from pxr import Usd, UsdGeom, UsdSkel

    query = cache.GetSkelQuery(skeleton)
    tokens = tuple(str(token) for token in (skeleton.GetJointsAttr().Get() or ()))
    if len(set(tokens)) != len(tokens) or not all(tokens):
        raise UserError(f"The skeleton {skeleton.GetPath()} names a joint twice; rename its joints.")
    parents = np.array(UsdSkel.Topology(skeleton.GetJointsAttr().Get() or []).GetParentIndices(), np.int64)
    parents = parents.reshape(-1)
    count = len(tokens)
    orphans = [t for t, p in zip(tokens, parents) if p < 0 and "/" in t]
    if orphans:
        notes.append(f"The joint above {orphans[0]} is missing; {len(orphans)} joints became roots.")
    parts = []
    for attr, what in ((skeleton.GetRestTransformsAttr(), "rest"), (skeleton.GetBindTransformsAttr(), "bind")):
        values = attr.Get()
        found = None if values is None else np.array(values, np.float64).reshape(-1, 4, 4).swapaxes(1, 2)
        if found is not None and len(found) and len(found) != count:
            raise UserError(
                f"The skeleton {skeleton.GetPath()} has {len(found)} {what} transforms for {count} joints; "
                "export it again."
            )
        parts.append(found if found is not None and len(found) else None)
    rest, bind = parts
    if not count:
        rest = bind = np.zeros((0, 4, 4))
    elif rest is None and bind is None:
        raise UserError(f"The skeleton {skeleton.GetPath()} does not say where its joints are; export its rest pose.")
    elif rest is None:
        assert bind is not None
        rest = np.stack([np.linalg.solve(bind[p], bind[j]) if p >= 0 else bind[j] for j, p in enumerate(parents)])
        notes.append(f"The skeleton {skeleton.GetPrim().GetName()} has no rest pose; the pose it was bound in is used.")
    elif bind is None:
        bind = concatenated(rest, parents)
        notes.append(f"The skeleton {skeleton.GetPrim().GetName()} has no bind pose; its rest pose is used.")
    assert rest is not None
    assert bind is not None
    imageable = UsdGeom.Imageable(skeleton.GetPrim())
    world = np.array(imageable.ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime()), np.float64).T
    size = abs(float(np.linalg.det(world[:3, :3])))
    if not np.isfinite(size) or size < 1e-30:
        raise UserError(f"The skeleton {skeleton.GetPath()} is scaled to nothing; give it a scale and export it again.")
    root = int(np.argmin(parents)) if count else 0
    moved = rest_from_bind(bind[root], world @ rest[root]) if count else world
    scale = 1.0 if abs(size ** (1 / 3) - 1.0) < 1e-6 else size ** (1 / 3)
    return _Skel(query, tokens, first, parents, rest, bind, world, scale, moved)


def _names(tokens: list[str]) -> tuple[str, ...]:
    """The last words of the paths of joints where they differ, whole paths where they do not."""
    last = [token.rsplit("/", 1)[-1] for token in tokens]
    often = {name for name in last if last.count(name) > 1} if len(set(last)) != len(last) else set()
    return tuple(token if name in often else name for name, token in zip(last, tokens, strict=True))


def _meshes(
    stage: Any, bound: dict[str, tuple[int, Any]], skels: list[_Skel], notes: list[str]
) -> list[RigPiece]:
    from pxr import Usd, UsdGeom

    time = Usd.TimeCode.EarliestTime()
    transforms = UsdGeom.XformCache(time)
    shown: list[RigPiece] = []
    hidden: list[RigPiece] = []
    still = sum(len(s.tokens) for s in skels)  # one past the joints: what no joint moves
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdGeom.Mesh):
            continue
        found = bound.get(str(prim.GetPath()))
        world: Array = np.array(transforms.GetLocalToWorldTransform(prim), np.float64).T
        skel = skinning = None
        if found is not None and found[1].HasJointInfluences():
            skel, skinning = skels[found[0]], found[1]
            world = skel.object_from_bind @ np.array(skinning.GetGeomBindTransform(time), np.float64).T
        piece = mesh_piece(prim, time, world.T)
        if piece is None:
            continue
        count = len(piece.points)
        joints = np.full((count, 1 if still else 0), still, np.int64)
        weights = np.ones(joints.shape)
        dual = None
        if skel is not None and skinning is not None:
            joints, weights = _influences(prim, skinning, skel, count, time)
            dual = _dual(prim, str(skinning.GetSkinningMethod()), count)
        made = RigPiece(piece, joints, weights, _shapes(prim, count, world, notes), dual)
        image = UsdGeom.Imageable(prim)
        is_shown = (
            image.ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
            and image.ComputeVisibility(time) != UsdGeom.Tokens.invisible
        )
        (shown if is_shown else hidden).append(made)
    return shown or hidden


def _dual(prim: Any, method: str, count: int) -> NDArray[np.bool_]:
    """Which vertices (count,) of a mesh its dual quaternions skin: those the writer said, else all of such a mesh."""
    from pxr import UsdGeom

    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar(DUAL)
    said = primvar.Get() if primvar else None
    if method == "dualQuaternion" and said is not None and len(said) == count:
        return np.array(said, np.bool_)
    return np.full(count, method == "dualQuaternion")


def _skinning(
    pieces: list[RigPiece],
) -> tuple[Literal["linear", "dual-quaternion", "mixed"], NDArray[np.bool_] | None]:
    """How all pieces together are skinned, and which vertices by dual quaternions where not all are alike."""
    skinned = [piece.dual for piece in pieces if piece.dual is not None]
    if not any(dual.any() for dual in skinned):
        return "linear", None
    if all(dual.all() for dual in skinned):
        return "dual-quaternion", None
    return "mixed", np.concatenate([
        np.zeros(len(piece.polygons.points), np.bool_) if piece.dual is None else piece.dual for piece in pieces])


def _influences(
    prim: Any, skinning: Any, skel: _Skel, count: int, time: Any
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Joints among all joints and weights (V, K) of a mesh; -1 for a joint its skeleton does not have."""
    order = skinning.GetJointOrder()
    tokens = skel.tokens if not order else tuple(str(t) for t in order)
    table = np.array([skel.first + skel.tokens.index(t) if t in skel.tokens else -1 for t in tokens], np.int64)
    wide = skinning.GetNumInfluencesPerComponent()
    indices = skinning.GetJointIndicesPrimvar().ComputeFlattened(time)
    weights = skinning.GetJointWeightsPrimvar().ComputeFlattened(time)
    rows = np.zeros(0, np.int64) if indices is None else np.array(indices, np.int64)
    shares = np.zeros(0) if weights is None else np.array(weights, np.float64)
    if skinning.IsRigidlyDeformed() and len(rows) == len(shares) == wide:
        rows, shares = np.tile(rows, count), np.tile(shares, count)
    if wide < 1 or len(rows) != len(shares) or len(rows) != wide * count:
        raise UserError(
            f"The mesh {prim.GetPath()} has {len(rows)} joint indices and {len(shares)} weights, which do not fit "
            f"{count} vertices with {wide} each; export it again."
        )
    there = (rows >= 0) & (rows < len(table))
    rows = np.where(there, table[np.where(there, rows, 0)] if len(table) else -1, -1)
    return rows.reshape(count, wide), shares.reshape(count, wide)


def _shapes(prim: Any, count: int, world: Array, notes: list[str]) -> dict[str, Targets]:
    """Targets of the blend shapes of a mesh by name, offsets turned with the mesh."""
    from pxr import UsdSkel

    binding = UsdSkel.BindingAPI(prim)
    tokens = binding.GetBlendShapesAttr().Get() or ()
    paths = binding.GetBlendShapeTargetsRel().GetTargets()
    if len(tokens) != len(paths):
        if tokens or paths:
            notes.append(f"The mesh {prim.GetName()} has {len(tokens)} blend shape names for {len(paths)} targets.")
        tokens, paths = tokens[: len(paths)], paths[: len(tokens)]
    found: dict[str, Targets] = {}
    for token, path in zip(tokens, paths):
        shape = UsdSkel.BlendShape(prim.GetStage().GetPrimAtPath(path))
        if not shape or not str(token):
            notes.append(f"The blend shape {token} of {prim.GetName()} is missing.")
            continue
        rows = shape.GetPointIndicesAttr().Get()
        index = np.arange(count) if rows is None or not len(rows) else np.array(rows, np.int64)
        targets: Targets = {}
        wanted = [(1.0, shape.GetOffsetsAttr().Get())]
        wanted += [(between.GetWeight(), between.GetOffsets()) for between in shape.GetInbetweens()]
        for at, values in wanted:
            offsets = np.zeros((0, 3)) if values is None else np.array(values, np.float64).reshape(-1, 3)
            if not len(offsets):
                offsets = np.zeros((len(index), 3))  # a target of normals alone moves no vertex
            if at is None or len(offsets) != len(index) or (len(index) and not 0 <= index.min() <= index.max() < count):
                notes.append(f"A target of the blend shape {token} does not fit the mesh {prim.GetName()}; left out.")
                continue
            targets[float(at)] = (index, offsets @ world[:3, :3].T)
        if targets:
            found[str(token)] = targets
    return found


def _clips(stage: Any, skels: list[_Skel], shapes: set[str]) -> list[RawClip]:
    """All SkelAnimations as clips, those that are bound first; bound ones of several skeletons are one clip."""
    from pxr import Usd, UsdSkel

    cache = UsdSkel.Cache()
    bound: dict[str, list[_Skel]] = {}
    for skel in skels:
        query = skel.query.GetAnimQuery() if skel.query else None
        if query:
            bound.setdefault(str(query.GetPrim().GetPath()), []).append(skel)
    prims = [
        prim for prim in stage.Traverse(Usd.TraverseInstanceProxies())
        if prim.IsA(UsdSkel.Animation) and str(prim.GetPath()) not in bound
    ]
    groups: list[list[tuple[Any, list[_Skel]]]] = []
    if bound:
        groups.append([(stage.GetPrimAtPath(path), theirs) for path, theirs in bound.items()])
    groups += [[(prim, skels)] for prim in prims]
    made = [_clip(stage, cache, group, skels, shapes) for group in groups]
    return [clip for clip in made if clip is not None]


def _clip(
    stage: Any, cache: Any, group: list[tuple[Any, list[_Skel]]], skels: list[_Skel], shapes: set[str]
) -> RawClip | None:
    from pxr import UsdSkel

    queries = [(cache.GetAnimQuery(UsdSkel.Animation(prim)), theirs) for prim, theirs in group]
    queries = [(query, theirs) for query, theirs in queries if query]
    if not queries:
        return None
    times = np.concatenate([np.zeros(0)] + [
        np.array(samples, np.float64) for query, _ in queries
        for samples in (query.GetJointTransformTimeSamples(), query.GetBlendShapeWeightTimeSamples())
    ])
    times = times[np.isfinite(times) & (np.abs(times) < 1e9)]
    start, end = (0.0, 0.0) if not len(times) else (float(np.floor(times.min())), float(np.ceil(times.max())))
    total = sum(len(s.tokens) for s in skels)
    name = group[0][0].GetName()
    check_frames(name, int(end - start) + 1, total)
    frames = np.arange(start, end + 0.5)
    local = np.tile(np.concatenate([np.zeros((0, 4, 4)), *(s.local(s.rest) for s in skels)]), (len(frames), 1, 1, 1))
    numbers: dict[str, Array] = {}
    for query, theirs in queries:
        tokens = [str(token) for token in query.GetJointOrder()]
        names = [str(token) for token in query.GetBlendShapeOrder()]
        authored = [_transforms(query, len(tokens), float(f)) for f in frames] if tokens else []
        for skel in theirs:
            pairs = [(row, skel.tokens.index(t)) for row, t in enumerate(tokens) if t in skel.tokens]
            if pairs and authored and all(a is not None for a in authored):
                whole = np.tile(skel.rest, (len(frames), 1, 1, 1))
                moved = np.stack([a for a in authored if a is not None])
                whole[:, [j for _, j in pairs]] = moved[:, [row for row, _ in pairs]]
                local[:, skel.first : skel.first + len(skel.tokens)] = skel.local(whole)
        weights = [query.ComputeBlendShapeWeights(float(f)) for f in frames] if names else []
        if weights and all(w is not None and len(w) == len(names) for w in weights):
            values = np.array([np.array(w, np.float64) for w in weights])
            numbers |= {n: values[:, row] for row, n in enumerate(names) if n in shapes}
    t, q, s, _ = split_matrices(local)
    columns = np.stack(list(numbers.values()), 1) if numbers else np.zeros((len(frames), 0))
    return RawClip(name, start, float(stage.GetTimeCodesPerSecond()), t, q, s, tuple(numbers), columns)


def _transforms(query: Any, joints: int, frame: float) -> Array | None:
    """Authored local matrices (J, 4, 4) of an animation; None when it has none that fit."""
    values = query.ComputeJointLocalTransforms(frame)
    if values is None or len(values) != joints:
        return None
    return np.array(values, np.float64).reshape(joints, 4, 4).swapaxes(1, 2)
