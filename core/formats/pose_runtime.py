"""The runtime file: a rig with its pose spaces solved, as JSON beside an .npz, for games and pipelines.

``arm.json`` says what there is and names arrays of ``arm.npz``; docs/pose.md prints a reader in numpy alone. All
matrices are solved, so that a reader only multiplies. Ours reads it back into a :class:`Runtime` to check it: nothing
is unpickled, every array has a bound and a shape.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.document import MeshObject
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.given_file import decoded_json
from core.pose.blend_shapes import BlendShapes
from core.pose.pose_space import Kernel
from core.pose.rig import Rig
from core.pose.synthesis import Prepared, prepare

FORMAT: Literal["filoplume-runtime"] = "filoplume-runtime"
VERSION = 2
LARGEST_JSON, LARGEST_ARRAYS = 64 << 20, 4 << 30  # bytes
DAMAGE = (ValueError, KeyError, IndexError, OverflowError, EOFError, zipfile.BadZipFile, NotImplementedError)
ARRAYS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "points": ("<f4", (None, 3)), "parents": ("<i4", (None,)), "rest": ("<f8", (None, 4, 4)),
    "inverse_bind": ("<f8", (None, 4, 4)), "joints": ("<i4", (None, None)), "weights": ("<f4", (None, None)),
    "file_vertices": ("<i4", (None,)), "shape": ("<i4", (None,)), "shape_at": ("<f8", (None,)),
    "shape_starts": ("<i8", (None,)), "shape_vertices": ("<i4", (None,)), "shape_offsets": ("<f4", (None, 3)),
}
SYSTEM_ARRAYS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "centres": ("<f8", (None, None)), "scales": ("<f8", (None, None)), "inverse": ("<f8", (None, None)),
    "middle": ("<f8", (None,)), "across": ("<f8", (None, None)), "samples": ("<i4", (None,)),
}
RUN_ARRAYS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "vertices": ("<i4", (None,)), "deltas": ("<f4", (None, None, 3)),
}


class RuntimeDof(msgspec.Struct, forbid_unknown_fields=True):
    control: str
    kind: Literal["swing", "twist", "swing-twist", "translation", "number"]
    axis: tuple[float, float, float]
    side: tuple[float, float, float]
    rest: float


class RuntimeSystem(msgspec.Struct, forbid_unknown_fields=True):
    """Poses solved together. `silent` centres come first and move nothing; `size` is of the affine part, 0 without."""

    silent: int
    size: float


class RuntimeRun(msgspec.Struct, forbid_unknown_fields=True):
    """Vertices that follow one system; `after`: corrected after skinning."""

    system: int
    after: bool


class RuntimeLayer(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    kernel: Kernel
    kernel_version: int
    normalise: Literal["none", "above-one", "always"]
    clamp: bool
    table: int
    dofs: list[RuntimeDof]
    poses: list[str]
    systems: list[RuntimeSystem]
    runs: list[RuntimeRun]


class RuntimeHead(msgspec.Struct, forbid_unknown_fields=True):
    format: Literal["filoplume-runtime"]
    version: int
    name: str
    arrays: str
    skinning: Literal["linear", "dual-quaternion", "mixed"]
    joints: list[str]
    shapes: list[str]
    numbers: dict[str, float]
    layers: list[RuntimeLayer]


class Runtime(NamedTuple):
    """What a runtime file holds: the head, and arrays by name (``layer0.run2.deltas``)."""

    head: RuntimeHead
    arrays: dict[str, NDArray[Any]]


def runtime_of(item: MeshObject, arrays_name: str) -> Runtime:
    """The runtime of a mesh with its rig and correctives.

    Raises
    ------
    UserError
        When there is no rig, or it has plain correctives, which the format does not know.
    """
    rig = item.rig
    if rig is None:
        raise UserError(f"{item.name} has no rig to write; give it a skeleton first.")
    names, arrays = _carriers(rig)
    arrays |= {
        "points": item.mesh.points,
        "file_vertices": np.arange(len(item.mesh.points)) if rig.file_vertices is None else rig.file_vertices,
    }
    if rig.dual is not None:
        arrays["dual"] = rig.dual
    if rig.shapes is not None:
        arrays |= _targets_with_rest(rig.shapes)
    layers = [_layer(k, ready, arrays) for k, ready in enumerate(prepare(item.correctives, rig))]
    head = RuntimeHead(
        FORMAT, VERSION, item.name, arrays_name, rig.skinning, names,
        [] if rig.shapes is None else list(rig.shapes.names), {c.name: c.rest for c in rig.controls}, layers,
    )
    return Runtime(head, arrays)


def write_runtime(path: Path, item: MeshObject) -> None:
    """Write `path` (.json) and the .npz beside it, each as a whole or not at all.

    Raises
    ------
    UserError
        As :func:`runtime_of`, or when the disk refuses.
    """
    beside = path.with_suffix(".npz")
    runtime = runtime_of(item, beside.name)
    kinds = {name: kind for name, (kind, _) in _expected(runtime.head).items()}
    with atomic_write(beside) as temp, temp.open("wb") as file:
        np.savez(file, allow_pickle=False, **{n: np.asarray(a, kinds[n]) for n, a in runtime.arrays.items()})
    with atomic_write(path) as temp:
        temp.write_bytes(msgspec.json.format(msgspec.json.encode(runtime.head), indent=1))


def read_runtime(path: Path) -> Runtime:
    """Read and check a runtime file.

    Raises
    ------
    UserError
        When one of the two files is missing, damaged, of a newer version, or they do not belong together.
    """
    head = decoded_json(path, RuntimeHead, "a runtime file", LARGEST_JSON)
    if head.version != VERSION:
        raise UserError(f"{path.name} is of version {head.version}, this program reads {VERSION}; write it again.")
    if Path(head.arrays).name != head.arrays or not head.arrays.endswith(".npz"):
        raise UserError(f"{path.name} names arrays outside its folder; write it again.")
    try:
        arrays = _arrays(path.with_name(head.arrays), head)
        _check(head, arrays)
    except OSError as error:
        raise UserError(f"{head.arrays} cannot be opened ({error.strerror or error}).") from None
    except DAMAGE as error:
        raise UserError(f"{head.arrays} is damaged or does not belong to {path.name}: {error}.") from error
    return Runtime(head, arrays)


def _carriers(rig: Rig) -> tuple[list[str], dict[str, NDArray[Any]]]:
    """Names of the joints, and their arrays; what no joint moves is carried by a last one that stays."""
    skeleton, names, still = rig.skeleton, list(rig.skeleton.names), np.eye(4)[None]
    inverse = np.linalg.inv(skeleton.bind)
    if rig.skin.joints.shape[1]:
        return names, {
            "parents": skeleton.parents, "rest": skeleton.rest, "inverse_bind": inverse, "joints": rig.skin.joints,
            "weights": rig.skin.weights,
        }
    count = len(rig.skin.joints)
    names.append(next(n for n in ("still", *(f"still{i}" for i in range(len(names)))) if n not in names))
    return names, {
        "parents": np.append(skeleton.parents, -1), "rest": np.concatenate([skeleton.rest, still]),
        "inverse_bind": np.concatenate([inverse, still]), "joints": np.full((count, 1), len(names) - 1),
        "weights": np.ones((count, 1)),
    }


def _targets_with_rest(shapes: BlendShapes) -> dict[str, NDArray[Any]]:
    """Arrays of the targets of all shapes, each shape with rest, which moves nothing, as its target at 0."""
    own = len(shapes.shape)
    shape = np.concatenate([shapes.shape, np.arange(len(shapes.names))])
    at = np.concatenate([shapes.at, np.zeros(len(shapes.names))])
    order = np.lexsort((at, shape))
    rows = [np.arange(shapes.starts[t], shapes.starts[t + 1]) if t < own else np.zeros(0, np.int64) for t in order]
    taken = np.concatenate(rows)
    return {
        "shape": shape[order], "shape_at": at[order], "shape_starts": np.cumsum([0, *map(len, rows)]),
        "shape_vertices": shapes.vertices[taken], "shape_offsets": shapes.offsets[taken],
    }


def _layer(k: int, ready: Prepared, arrays: dict[str, NDArray[Any]]) -> RuntimeLayer:
    space = ready.layer.space
    if ready.layer.kind != "pose-space":
        raise UserError(f"The layer {ready.layer.name!r} is a plain corrective; switch it to pose space first.")
    systems: list[RuntimeSystem] = []
    runs: list[RuntimeRun] = []
    places: dict[int, int] = {}
    for g, solved in enumerate(ready.solved):
        assert solved is not None
        rows = slice(int(ready.starts[g]), int(ready.starts[g + 1]))
        known = ready.layer.moved[:, rows.start]
        if id(solved) not in places:
            places[id(solved)] = len(systems)
            at = f"layer{k}.system{len(systems)}"
            plane = solved.plane
            systems.append(RuntimeSystem(solved.silent, 0.0 if plane is None else float(plane.size)))
            arrays |= {
                f"{at}.centres": solved.centres, f"{at}.scales": solved.scales,
                # Shepard's shares are the weights
                f"{at}.inverse": np.eye(len(solved.centres)) if solved.inverse is None else solved.inverse,
                f"{at}.middle": np.zeros(0) if plane is None else plane.middle,
                f"{at}.across": np.zeros((0, 0)) if plane is None else plane.across,
                f"{at}.samples": np.flatnonzero(known),
            }
        at = f"layer{k}.run{len(runs)}"
        arrays[f"{at}.vertices"] = ready.layer.vertices[rows]
        arrays[f"{at}.deltas"] = ready.layer.deltas[known][:, rows]
        runs.append(RuntimeRun(places[id(solved)], bool(ready.after[g])))
    return RuntimeLayer(
        ready.layer.name, space.kernel, space.kernel_version, space.normalise, space.clamp, space.table,
        [RuntimeDof(d.control, d.kind, d.axis, d.side, d.rest) for d in space.dofs],
        [sample.name for sample in space.samples], systems, runs,
    )


def _expected(head: RuntimeHead) -> dict[str, tuple[str, tuple[int | None, ...]]]:
    """dtype and shape of every array that `head` announces."""
    out = {name: kind for name, kind in ARRAYS.items() if head.shapes or not name.startswith("shape")}
    if head.skinning == "mixed":
        out["dual"] = ("|b1", (None,))
    for k, layer in enumerate(head.layers):
        for s in range(len(layer.systems)):
            out |= {f"layer{k}.system{s}.{name}": kind for name, kind in SYSTEM_ARRAYS.items()}
        for r in range(len(layer.runs)):
            out |= {f"layer{k}.run{r}.{name}": kind for name, kind in RUN_ARRAYS.items()}
    return out


def _arrays(path: Path, head: RuntimeHead) -> dict[str, NDArray[Any]]:
    expected = _expected(head)
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        names = [info.filename for info in members]
        if sorted(names) != sorted(f"{name}.npy" for name in expected):
            raise ValueError("it holds other arrays than it says")
        if any(info.compress_type != zipfile.ZIP_STORED for info in members):
            raise ValueError("its arrays are compressed")
        if sum(info.file_size for info in members) > min(LARGEST_ARRAYS, path.stat().st_size):
            raise ValueError("its arrays are larger than the file")
    out: dict[str, NDArray[Any]] = {}
    with np.load(path, allow_pickle=False) as file:
        for name, (kind, shape) in expected.items():
            array = file[name]
            if array.dtype.str != kind or array.ndim != len(shape) or any(
                want is not None and want != have for want, have in zip(shape, array.shape, strict=True)
            ):
                raise ValueError(f"{name} has another type or shape than it should")
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                raise ValueError(f"{name} holds values that are not finite")
            out[name] = array
    return out


def _check(head: RuntimeHead, arrays: dict[str, NDArray[Any]]) -> None:
    """Counts and indices agree, so that a reader never reaches outside an array."""
    vertices, joints = len(arrays["points"]), len(head.joints)

    def must(holds: bool, what: str) -> None:
        if not holds:
            raise ValueError(what)

    def within(name: str, count: int, least: int = 0) -> None:
        values = arrays[name]
        must(not values.size or (values.min() >= least and values.max() < count), f"{name} reaches outside")

    must(all(len(arrays[n]) == joints for n in ("parents", "rest", "inverse_bind")), "joints are missing")
    parents = arrays["parents"]
    must(bool(((parents < np.arange(joints)) & (parents >= -1)).all()), "parents come later")
    must(arrays["joints"].shape == arrays["weights"].shape, "weights are missing")
    must(len(arrays["joints"]) == vertices == len(arrays.get("dual", arrays["joints"])), "the skin does not fit")
    within("joints", joints)
    within("file_vertices", vertices)
    if head.shapes:
        targets, rows = len(arrays["shape"]), len(arrays["shape_vertices"])
        starts = arrays["shape_starts"]
        must(len(starts) == targets + 1 and len(arrays["shape_at"]) == targets, "targets are missing")
        must(bool(starts[0] == 0 and starts[-1] == rows and (np.diff(starts) >= 0).all()), "targets overlap")
        must(len(arrays["shape_offsets"]) == rows, "offsets are missing")
        within("shape", len(head.shapes))
        within("shape_vertices", vertices)
        stops, steps = np.bincount(arrays["shape"], minlength=len(head.shapes)), np.diff(arrays["shape"])
        rises = np.diff(arrays["shape_at"])[steps == 0]
        must(bool(stops.min() >= 2 and (steps >= 0).all() and (rises > 0).all()), "a shape goes nowhere")
    widths = {"swing": 3, "twist": 2, "swing-twist": 5, "translation": 3, "number": 1}
    for k, layer in enumerate(head.layers):
        wide = sum(widths[dof.kind] for dof in layer.dofs)
        must(layer.kernel_version == 1, "a kernel is of a newer version")
        must(layer.table == 0 or 2 <= layer.table <= 1 << 16, "a table has an impossible size")
        for s, system in enumerate(layer.systems):
            at = f"layer{k}.system{s}"
            centres, inverse = arrays[f"{at}.centres"], arrays[f"{at}.inverse"]
            extra = arrays[f"{at}.across"].shape[1] + 1 if system.size else 0
            must(centres.shape[1] == wide and arrays[f"{at}.scales"].shape == centres.shape, "centres do not fit")
            must(inverse.shape == (len(centres) + extra, len(centres)), "a system does not fit")
            must(not system.size or (len(arrays[f"{at}.across"]) == wide == len(arrays[f"{at}.middle"])), "a plane")
            must(0 <= system.silent <= len(centres), "a system has impossible centres")
            must(len(arrays[f"{at}.samples"]) == len(centres) - system.silent, "samples do not fit")
            within(f"{at}.samples", len(layer.poses))
        for r, run in enumerate(layer.runs):
            at = f"layer{k}.run{r}"
            must(0 <= run.system < len(layer.systems), "a run names a system that is not there")
            samples = len(arrays[f"layer{k}.system{run.system}.samples"])
            must(arrays[f"{at}.deltas"].shape[:2] == (samples, len(arrays[f"{at}.vertices"])), "deltas do not fit")
            within(f"{at}.vertices", vertices)
