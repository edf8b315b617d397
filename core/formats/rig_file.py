"""Rigs in, by the suffix of the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from core.document import Document, MeshObject
from core.errors import UserError
from core.formats import bvh, gltf_rig, tgf
from core.formats.file_space import axis_of, metres_of
from core.formats.given_file import must_be_readable
from core.formats.rig_assembly import RigFile, assemble
from core.formats.rig_parts import RawRig, unpack_rig
from core.formats.sandbox import run_bounded
from core.pose.rig import control_names

Say = Callable[[str], None]
SECONDS, MEMORY = 120.0, 8 << 30  # limits of a native reader
LARGEST_FILE = 4 << 30  # bytes
DAMAGE = (ValueError, IndexError, KeyError, OverflowError, RecursionError, np.linalg.LinAlgError)

NATIVE = {
    ".usd": "core.formats.usd_rig:read_in_child", ".usda": "core.formats.usd_rig:read_in_child",
    ".usdc": "core.formats.usd_rig:read_in_child", ".usdz": "core.formats.usd_rig:read_in_child",
}  # fmt: skip
READERS: dict[str, Callable[[Path], RawRig]] = {
    ".glb": gltf_rig.read_raw, ".gltf": gltf_rig.read_raw, ".bvh": bvh.read_raw, ".tgf": tgf.read_raw,
}  # fmt: skip
READ_SUFFIXES = (*NATIVE, *READERS)


def read_rig(
    path: str | Path, unit: str | None = None, up: str | None = None, say: Say | None = None,
    sandboxed: bool = True, cancel: Callable[[], bool] | None = None,
) -> RigFile:
    """Read skeletons, skins, blend shapes and clips of any known format.

    Parameters
    ----------
    unit, up : unit (m, cm, mm, in, ft) and up axis (y, z) of a file that does not say; what a file says wins.
    say : called with each sentence of the notes.
    sandboxed : run native readers in a child process. False only for files this program has just written.
    cancel : asked now and then while a native reader works.

    Raises
    ------
    NoRig
        When nothing in the file moves.
    UserError
        One sentence: an unknown format, a file that is missing or damaged, a rig that contradicts itself.
    """
    path = Path(path)
    _must_be_a_rig(path)
    metres_given = None if unit is None else metres_of(unit)
    up_given = None if up is None else axis_of(up)
    try:
        raw = _read(path, sandboxed, cancel)
        with np.errstate(all="ignore"):  # what is not finite is found by the checks
            found = assemble(raw, path.stem or "rig", metres_given, up_given)
    except DAMAGE as error:
        raise UserError(f"{path.name} is damaged and cannot be read; export it again.") from error
    except MemoryError:
        raise UserError(f"{path.name} is too large for the memory of this machine.") from None
    except UserError as error:
        if path.name in str(error):
            raise
        raise type(error)(f"{path.name}: {error}") from error
    for note in found.notes if say is not None else ():
        assert say is not None
        say(note)
    return found


def document_of(found: RigFile) -> Document:
    """A document of one rig; its timeline is that of the clip that plays.

    Raises
    ------
    UserError
        When the file has no mesh.
    """
    if found.mesh is None:
        raise UserError(f"{found.name} has a skeleton but no mesh; open the rig that it moves.")
    item = MeshObject(id=1, name=found.name, mesh=found.mesh, rig=found.rig, correctives=found.correctives)
    clip = found.rig.clip
    if clip is None:
        return Document(meshes=(item,))
    first, last = int(np.floor(clip.start)), int(np.ceil(clip.end))
    return Document(meshes=(item,), fps=clip.frames_per_second, first_frame=first, last_frame=last)


def rig_info(found: RigFile) -> dict[str, Any]:
    """What a rig has, as plain JSON values: `controls` are joints and abstract controls by name."""
    rig = found.rig
    return {
        "controls": list(control_names(rig)),
        "joints": len(rig.skeleton.names),
        "shapes": 0 if rig.shapes is None else len(rig.shapes.names),
        "influences": rig.skin.joints.shape[1],
        "skinning": rig.skinning,
        "clips": [
            {"name": clip.name, "start": clip.start, "end": clip.end, "frames_per_second": clip.frames_per_second}
            for clip in found.clips
        ],
        "notes": list(found.notes),
    }


def _must_be_a_rig(path: Path) -> None:
    if path.suffix.lower() == ".fbx":
        raise UserError(f"{path.name} is an FBX file, which is not read; export the rig as USD or glTF.")
    if path.suffix.lower() not in READ_SUFFIXES:
        raise UserError(f"{path.name} is no rig format that is known; use {', '.join(READ_SUFFIXES)}.")
    must_be_readable(path, "rig", LARGEST_FILE)


def _read(path: Path, sandboxed: bool, cancel: Callable[[], bool] | None) -> RawRig:
    suffix = path.suffix.lower()
    if suffix in READERS:
        return READERS[suffix](path)
    where = {"path": str(path.resolve())}
    if not sandboxed:
        from core.formats import usd_rig

        return unpack_rig(usd_rig.read_in_child(**where))
    return unpack_rig(
        run_bounded(NATIVE[suffix], where, what=path.name, seconds=SECONDS, memory=MEMORY, cancel=cancel)
    )
