"""Rigs as UsdSkel: skeleton, skin, blend shapes with inbetweens, clip, corrections as shapes with their drivers.

Corrections become blend shapes whose weights are baked along the clip. What drives them stands as JSON in the custom
data ``filoplume:drivers`` of the SkelRoot: every shape with its layer and sample, and every layer with its pose space
(kernel, degrees of freedom with axes and falloffs, poses), which is all that is needed to drive them anew. The layers
themselves are kept by ``usd_corrections``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.document import MeshObject
from core.errors import UserError
from core.formats import usd_corrections
from core.formats.corrective_shapes import CorrectiveShapes, corrective_shapes, shape_weights_at
from core.formats.usd_stage import define_mesh
from core.pose.blend_shapes import BlendShapes, dense_offsets, shape_weights
from core.pose.pose_space import PoseSpace
from core.pose.rig import Rig, resting_numbers
from core.pose.synthesis import pose_at

DRIVERS = "filoplume:drivers"
DUAL = "filoplume:dualQuaternion"  # primvar: which vertices of a mesh of mixed skinning they skin
STILL = "still"  # a joint for what no joint moves


def write(path: Path, item: MeshObject, fps: float) -> tuple[str, ...]:
    """Write `item`, metres, Y up; returns sentences about what could not be said.

    Raises
    ------
    UserError
        When there is no rig, or the file could not be written.
    """
    from pxr import Sdf, Usd, UsdGeom, UsdSkel

    rig = item.rig
    if rig is None:
        raise UserError(f"{item.name} has no rig to write; give it a skeleton first.")
    layer = Sdf.Layer.CreateAnonymous(path.suffix.lower())
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    rate = fps if rig.clip is None else rig.clip.frames_per_second
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    if rig.clip is not None:
        stage.SetStartTimeCode(rig.clip.start)
        stage.SetEndTimeCode(rig.clip.end)
    root = UsdSkel.Root.Define(stage, "/Model")
    stage.SetDefaultPrim(root.GetPrim())
    tokens = joint_tokens(rig)
    skeleton = _skeleton(stage, rig, tokens)
    found = corrective_shapes(item)
    mesh = _mesh(stage, item, rig, skeleton)
    shapes = _shapes(stage, mesh, rig.shapes, found)
    _animation(stage, rig, tokens, item, found, shapes, skeleton)
    root.GetPrim().SetCustomDataByKey(DRIVERS, _drivers(found, shapes))
    usd_corrections.write(stage, item, shapes)
    if not layer.Export(str(path)):
        raise UserError(f"{path.name} could not be written; choose another folder.")
    if rig.dual is None:
        return found.notes
    return (*found.notes, f"{item.name} is skinned in two ways, which one mesh of USD is not: other programs skin all "
            "of it by dual quaternions.")


def joint_tokens(rig: Rig) -> list[str]:
    """Paths of the joints from their roots, of names that USD allows, each different."""
    from pxr import Tf

    taken: set[str] = set()
    names: list[str] = []
    out: list[str] = []
    for name in rig.skeleton.names or (STILL,):
        valid = Tf.MakeValidIdentifier(name)
        free = next(n for n in (valid, *(f"{valid}_{i}" for i in range(2, len(taken) + 3))) if n not in taken)
        taken.add(free)
        names.append(free)
    for joint, name in enumerate(names):
        parent = int(rig.skeleton.parents[joint]) if rig.skeleton.names else -1
        out.append(name if parent < 0 else f"{out[parent]}/{name}")
    return out


def _skeleton(stage: Any, rig: Rig, tokens: list[str]) -> Any:
    from pxr import UsdSkel, Vt

    made = UsdSkel.Skeleton.Define(stage, "/Model/Skeleton")
    still = np.eye(4)[None]
    rest, bind = (rig.skeleton.rest, rig.skeleton.bind) if rig.skeleton.names else (still, still)
    made.CreateJointsAttr(tokens)
    made.CreateJointNamesAttr(list(rig.skeleton.names) or [STILL])
    # USD multiplies rows from the left
    made.CreateRestTransformsAttr(Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(rest.swapaxes(1, 2))))
    made.CreateBindTransformsAttr(Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(bind.swapaxes(1, 2))))
    UsdSkel.BindingAPI.Apply(made.GetPrim())
    return made


def _mesh(stage: Any, item: MeshObject, rig: Rig, skeleton: Any) -> Any:
    from pxr import Gf, Sdf, Tf, UsdGeom, UsdSkel, Vt

    made = define_mesh(stage, f"/Model/{Tf.MakeValidIdentifier(item.name)}_mesh", item.name, item.mesh)
    binding = UsdSkel.BindingAPI.Apply(made.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    joints, weights = rig.skin.joints, rig.skin.weights
    if not joints.shape[1]:
        joints, weights = np.zeros((len(joints), 1), np.int32), np.ones((len(joints), 1), np.float32)
    wide = joints.shape[1]
    binding.CreateJointIndicesPrimvar(False, wide).Set(Vt.IntArray.FromNumpy(np.ascontiguousarray(joints).reshape(-1)))
    binding.CreateJointWeightsPrimvar(False, wide).Set(Vt.FloatArray.FromNumpy(weights.reshape(-1)))
    if rig.dual is not None:
        said = UsdGeom.PrimvarsAPI(made.GetPrim()).CreatePrimvar(
            DUAL, Sdf.ValueTypeNames.BoolArray, UsdGeom.Tokens.vertex)
        said.Set(Vt.BoolArray(rig.dual.tolist()))
    if rig.skinning != "linear":
        binding.CreateSkinningMethodAttr(UsdSkel.Tokens.dualQuaternion)
    return made


def _shapes(stage: Any, mesh: Any, own: BlendShapes | None, found: CorrectiveShapes) -> list[str]:
    """Define all blend shapes of the mesh; returns their tokens: the rig's own, then the corrections."""
    from pxr import Tf, UsdSkel, Vt

    names = [*(() if own is None else own.names), *(shape.name for shape in found.shapes)]
    tokens: list[str] = []
    for name in names:
        valid = Tf.MakeValidIdentifier(name)
        tokens.append(next(n for n in (valid, *(f"{valid}_{i}" for i in range(2, len(names) + 2))) if n not in tokens))
    paths = []
    for row, (name, token) in enumerate(zip(names, tokens, strict=True)):
        shape = UsdSkel.BlendShape.Define(stage, f"{mesh.GetPath()}/{token}")
        shape.GetPrim().SetDisplayName(name)
        paths.append(shape.GetPath())
        if own is not None and row < len(own.names):
            _own_shape(shape, own, row)
            continue
        correction = found.shapes[row - (0 if own is None else len(own.names))]
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(correction.offsets)))
        shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(correction.vertices)))
    if names:
        binding = UsdSkel.BindingAPI(mesh.GetPrim())
        binding.CreateBlendShapesAttr(tokens)
        binding.CreateBlendShapeTargetsRel().SetTargets(paths)
    return tokens


def _own_shape(shape: Any, own: BlendShapes, row: int) -> None:
    """Targets at other weights than 1 are inbetweens, over all vertices that any target of the shape moves."""
    from pxr import Tf, Vt

    mine = np.flatnonzero(own.shape == row)
    rows = [slice(int(own.starts[t]), int(own.starts[t + 1])) for t in mine]
    used = np.unique(np.concatenate([own.vertices[r] for r in rows]))
    count = int(used.max(initial=-1)) + 1
    ats = own.at[mine]
    whole = np.flatnonzero(np.abs(ats - 1.0) < 1e-6)
    # without a target at 1 the last two go straight on to it, or the only one from rest
    full = dense_offsets(own, int(mine[whole[0]]), count) if len(whole) else _extended(own, mine, count)
    shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(full[used])))
    shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(used.astype(np.int32)))
    for target, at in zip(mine, ats, strict=True):
        if abs(at - 1.0) >= 1e-6:
            between = shape.CreateInbetween(Tf.MakeValidIdentifier(f"at_{at:g}"))
            between.SetWeight(float(at))
            between.SetOffsets(Vt.Vec3fArray.FromNumpy(
                np.ascontiguousarray(dense_offsets(own, int(target), count)[used])))


def _extended(own: BlendShapes, mine: NDArray[np.int64], count: int) -> NDArray[np.float32]:
    stops = np.append(own.at[mine], 0.0)
    order = np.argsort(stops)
    shapes = [*(dense_offsets(own, int(t), count) for t in mine), np.zeros((count, 3), np.float32)]
    k = min(max(int(np.searchsorted(stops[order], 1.0)), 1), len(stops) - 1)
    (a, low), (b, high) = ((shapes[order[i]], stops[order[i]]) for i in (k - 1, k))
    return np.asarray(a + (b - a) * ((1.0 - low) / (high - low)), np.float32)


def _animation(
    stage: Any, rig: Rig, tokens: list[str], item: MeshObject, found: CorrectiveShapes, shapes: list[str], skeleton: Any
) -> None:
    from pxr import UsdSkel, Vt

    clip = rig.clip
    rests = {name: at for name, at in resting_numbers(rig).items() if at != 0.0}
    if clip is None and not (rests and rig.shapes is not None):
        return
    made = UsdSkel.Animation.Define(stage, "/Model/Animation")
    if shapes:
        made.CreateBlendShapesAttr(shapes)
    if clip is not None and rig.skeleton.names:
        made.CreateJointsAttr(tokens)
    attributes = (made.CreateTranslationsAttr(), made.CreateRotationsAttr(), made.CreateScalesAttr(),
                  made.CreateBlendShapeWeightsAttr())
    for sample in range(1 if clip is None else len(clip.translations)):
        frame = 0.0 if clip is None else clip.start + sample
        time = () if clip is None else (frame,)
        if clip is not None and rig.skeleton.names:
            attributes[0].Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(clip.translations[sample])), *time)
            attributes[1].Set(Vt.QuatfArray.FromNumpy(np.ascontiguousarray(clip.rotations[sample])), *time)
            attributes[2].Set(Vt.Vec3hArray.FromNumpy(clip.scales[sample].astype(np.float16)), *time)
        if shapes:
            pose = pose_at(rig, frame)
            numbers = {**resting_numbers(rig), **pose.numbers}
            own = np.zeros(0) if rig.shapes is None else shape_weights(rig.shapes, numbers)
            weights = np.concatenate([own, shape_weights_at(found, item, pose)]).astype(np.float32)
            attributes[3].Set(Vt.FloatArray.FromNumpy(weights), *time)
    UsdSkel.BindingAPI(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([made.GetPath()])


def _drivers(found: CorrectiveShapes, tokens: list[str]) -> str:
    """JSON: the layers' pose spaces, and for every correction its token, layer and sample."""
    spaces: list[PoseSpace] = [ready.layer.space for ready in found.layers]
    corrections = tokens[len(tokens) - len(found.shapes):]
    described = {
        "layers": [
            {"name": ready.layer.name, "space": msgspec.to_builtins(space)}
            for ready, space in zip(found.layers, spaces, strict=True)
        ],
        "shapes": [
            {"shape": token, "layer": shape.layer, "sample": shape.sample,
             "known": np.flatnonzero(found.layers[shape.layer].layer.moved[
                 :, found.layers[shape.layer].starts[shape.run]]).tolist()}
            for token, shape in zip(corrections, found.shapes, strict=True)
        ],
    }
    return msgspec.json.encode(described).decode()
