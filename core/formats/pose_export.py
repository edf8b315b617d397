"""A posed rig out, by the suffix of the file: the one place that knows who reads what."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from core.document import MeshObject
from core.errors import UserError
from core.formats import gltf_morph, point_cache, pose_drivers, pose_runtime, usd_skel_write
from core.formats.atomic import atomic_write

# each returns sentences to show
WRITERS: dict[str, Callable[[Path, MeshObject, float], tuple[str, ...]]] = {
    ".usda": usd_skel_write.write, ".usdc": usd_skel_write.write, ".glb": gltf_morph.write,
    ".py": pose_drivers.write_blender, ".mel": pose_drivers.write_maya,
}
SUFFIXES = (*WRITERS, ".json")


def write(path: Path, item: MeshObject, fps: float) -> tuple[str, ...]:
    """Write a mesh with its rig and correctives; returns sentences about what the format cannot say.

    Raises
    ------
    UserError
        An unknown suffix, something the format cannot hold, or a folder that cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".json":
        pose_runtime.write_runtime(path, item)  # writes two files, each by itself
        return ()
    if suffix not in WRITERS:
        raise UserError(f"{path.name}: a posed rig is written as {', '.join(SUFFIXES)}.")
    with atomic_write(path) as beside:
        return WRITERS[suffix](beside, item, fps)


def write_points(path: Path, item: MeshObject) -> None:
    """Write the points on every frame of the clip that plays, as USD time samples."""
    with atomic_write(path) as beside:
        point_cache.write(beside, item)
