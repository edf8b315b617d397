"""What a UsdSkel file cannot say of our corrections, kept beside its shapes so that we read back what we wrote.

The Scope ``/Model/Corrections`` holds, as custom attributes, ``filoplume:said`` (JSON: layers with their pose spaces,
controls, constraints, which shapes are corrections) and the arrays of every layer. Other programs use the shapes; we
take the layers, as long as the mesh is still the one they were made for.
"""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.formats.rig_parts import RawRig, RawSculpts
from core.pose.pose_space import Correctives, PoseLayer, PoseSpace, Way
from core.pose.rig import Constraint, Control, Rig
from core.record import freeze

if TYPE_CHECKING:
    from core.document import MeshObject

VERSION = 1
SCOPE, SAID = "Corrections", "filoplume:said"
LARGEST_JSON = 64 << 20  # characters
ARRAYS: dict[str, Any] = {
    "vertices": np.int32, "moved": np.uint8, "after": np.uint8, "deltas": np.float32, "targets": np.float32,
}


class _Layer(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    kind: Way
    enabled: bool
    space: PoseSpace


class _Said(msgspec.Struct, forbid_unknown_fields=True):
    """points : CRC-32 of the vertices as float32. names : of the rig's own shapes by their tokens.

    dials : numbers that the clip moves and that are no shapes, for which UsdSkel has no place.
    """

    version: int
    points: int
    names: dict[str, str]
    corrections: list[str]
    controls: list[Any]
    constraints: list[Constraint]
    dials: list[str]
    layers: list[_Layer]


class Restored(NamedTuple):
    """A rig with its controls and constraints as they were, and its corrections."""

    rig: Rig
    correctives: Correctives


def write(stage: Any, item: MeshObject, tokens: list[str]) -> None:
    """Write the corrections of `item`; `tokens` are those of its shapes, the rig's own first."""
    from pxr import Sdf, UsdGeom, Vt

    rig = item.rig
    if rig is None or item.correctives is None:
        return
    own = () if rig.shapes is None else rig.shapes.names
    said = _Said(
        VERSION, zlib.crc32(np.ascontiguousarray(item.mesh.points).tobytes()), dict(zip(tokens, own, strict=False)),
        tokens[len(own):], [msgspec.to_builtins(c, enc_hook=lambda a: a.tolist()) for c in rig.controls],
        list(rig.constraints), [n for n in (() if rig.clip is None else rig.clip.number_names) if n not in own],
        [_Layer(x.name, x.kind, x.enabled, x.space) for x in item.correctives.layers])
    prim = UsdGeom.Scope.Define(stage, f"/Model/{SCOPE}").GetPrim()
    prim.CreateAttribute(SAID, Sdf.ValueTypeNames.String, True).Set(msgspec.json.encode(said).decode())
    kinds = {
        np.int32: (Sdf.ValueTypeNames.IntArray, Vt.IntArray), np.uint8: (Sdf.ValueTypeNames.UCharArray, Vt.UCharArray),
        np.float32: (Sdf.ValueTypeNames.FloatArray, Vt.FloatArray),
    }

    def put(name: str, values: NDArray[Any], dtype: Any) -> None:
        kind, array = kinds[dtype]
        flat = np.ascontiguousarray(values).astype(dtype).reshape(-1)
        prim.CreateAttribute(f"filoplume:{name}", kind, True).Set(array.FromNumpy(flat))

    for k, layer in enumerate(item.correctives.layers):
        for name, dtype in ARRAYS.items():
            put(f"layer{k}:{name}", getattr(layer, name), dtype)
    if said.dials and rig.clip is not None and rig.clip.numbers is not None:
        put("clip:numbers", rig.clip.numbers[:, [rig.clip.number_names.index(name) for name in said.dials]], np.float32)


def read(stage: Any) -> RawSculpts | None:
    """What :func:`write` wrote into a stage, unchecked; None where there is nothing of the kind."""
    root = stage.GetDefaultPrim()
    prim = stage.GetPrimAtPath(root.GetPath().AppendChild(SCOPE)) if root else None
    said = prim.GetAttribute(SAID).Get() if prim and prim.HasAttribute(SAID) else None
    if prim is None or not isinstance(said, str) or len(said) > LARGEST_JSON:
        return None
    arrays: dict[str, NDArray[Any]] = {}
    for attribute in prim.GetAttributes():
        of, _, name = attribute.GetName().removeprefix("filoplume:").rpartition(":")
        if (of.startswith("layer") and name in ARRAYS) or (of, name) == ("clip", "numbers"):
            arrays[f"{of}:{name}"] = np.array(attribute.Get() or (), ARRAYS.get(name, np.float32))
    return RawSculpts(said, arrays)


def without_corrections(raw: RawRig) -> RawRig:
    """The rig as found, its own shapes under their names and the shapes that are corrections left out."""
    said = None if raw.sculpts is None else _said(raw.sculpts)
    if said is None:
        return raw._replace(sculpts=None)
    gone, names = set(said.corrections), said.names
    shapes = tuple(s._replace(name=names.get(s.name, s.name)) for s in raw.shapes if s.name not in gone)
    clips = []
    for clip in raw.clips:
        keep = [row for row, name in enumerate(clip.number_names) if name not in gone]
        clips.append(clip._replace(
            number_names=tuple(names.get(clip.number_names[row], clip.number_names[row]) for row in keep),
            numbers=clip.numbers[:, keep]))
    return raw._replace(shapes=shapes, clips=tuple(clips), rests={names.get(n, n): at for n, at in raw.rests.items()})


def fits(sculpts: RawSculpts, points: NDArray[np.float32]) -> bool:
    """True when the corrections were made for a mesh of just these vertices (V, 3)."""
    said = _said(sculpts)
    return said is not None and said.points == zlib.crc32(np.ascontiguousarray(points, np.float32).tobytes())


def restored(sculpts: RawSculpts, rig: Rig) -> Restored:
    """The rig and its corrections; ValueError, or one of its kind, where they contradict themselves."""
    said = _said(sculpts)
    if said is None:
        raise ValueError("it describes its corrections in an unknown way")
    controls = tuple(
        msgspec.convert(one, Control, dec_hook=lambda _, value: freeze(np.array(value, np.int32)))
        for one in said.controls)
    layers = []
    for k, one in enumerate(said.layers):
        vertices, moved, after, deltas, targets = (sculpts.arrays[f"layer{k}:{name}"] for name in ARRAYS)
        shape = len(one.space.samples), len(vertices)
        layers.append(PoseLayer(
            name=one.name, kind=one.kind, enabled=one.enabled, space=one.space, vertices=freeze(vertices),
            moved=freeze(moved.reshape(shape) > 0), after=freeze(after > 0), deltas=freeze(deltas.reshape(*shape, 3)),
            targets=freeze(targets.reshape(*shape, 3))))
    correctives = Correctives(layers=tuple(layers))
    if correctives.vertex_count > len(rig.skin.joints):
        raise ValueError("its corrections move a vertex that it does not have")
    clip = rig.clip
    if said.dials and clip is not None:
        frames = len(clip.translations)
        moved = np.zeros((frames, 0), np.float32) if clip.numbers is None else clip.numbers
        dials = sculpts.arrays["clip:numbers"].reshape(frames, len(said.dials))
        both = freeze(np.hstack([moved, dials]).astype(np.float32))
        clip = clip.replace(number_names=(*clip.number_names, *said.dials), numbers=both)
    whole: Rig = rig.replace(controls=controls, constraints=tuple(said.constraints), clip=clip)
    return Restored(whole, correctives)


def _said(sculpts: RawSculpts) -> _Said | None:
    try:
        said = msgspec.json.decode(sculpts.said, type=_Said)
    except (msgspec.DecodeError, ValueError, RecursionError):
        return None
    return said if said.version == VERSION else None
