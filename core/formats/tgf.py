"""Skeletons of libigl: points and bones in .tgf; mesh, weights and a pose in files of the same name beside it.

``arm.tgf`` takes ``arm.obj`` and ``arm-weights.dmat``, a column for each bone; ``hand-pose.dmat`` is one pose, four
numbers of a quaternion for each bone. A bone is a joint at its first point; it hangs on the bone that ends there.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.obj import read_obj
from core.formats.rig_parts import RawClip, RawRig

LARGEST = 256 << 20  # bytes


def read_raw(path: Path) -> RawRig:
    """The bones of a .tgf and what lies beside it, in its own units.

    Raises
    ------
    UserError
        When a file is not what it should be, or they do not fit together.
    """
    text = _text(path).split("#")
    try:
        points = {int(row[0]): [float(x) for x in row[1:4]] for row in map(str.split, text[0].splitlines()) if row}
        bones = [(int(row[0]), int(row[1])) for row in map(str.split, text[1].splitlines()) if row]
    except (ValueError, IndexError):
        raise UserError(f"{path.name} is not a skeleton of points and bones; export it again.") from None
    known = {point for point, place in points.items() if len(place) == 3}
    if not bones or not {end for bone in bones for end in bone} <= known:
        raise UserError(f"{path.name} has no bones, or bones between points that it does not have; export it again.")
    count = len(bones)
    ends = {tail: row for row, (_, tail) in reversed(list(enumerate(bones)))}
    parents = np.array([ends.get(head, -1) for head, _ in bones], np.int64)
    heads = np.array([points[head] for head, _ in bones])
    above = np.where(parents[:, None] >= 0, heads[parents], 0.0)
    rest, bind = np.tile(np.eye(4), (count, 1, 1)), np.tile(np.eye(4), (count, 1, 1))
    rest[:, :3, 3], bind[:, :3, 3] = heads - above, heads
    polygons, joints, weights = None, np.zeros((0, 0), np.int64), np.zeros((0, 0))
    mesh, table = path.with_suffix(".obj"), path.with_name(f"{path.stem}-weights.dmat")
    if mesh.is_file() and table.is_file():
        polygons, weights = read_obj(mesh), read_dmat(table)
        if weights.shape != (len(polygons.points), count):
            raise UserError(
                f"{table.name} has {weights.shape[0]} rows of {weights.shape[1]} for {len(polygons.points)} vertices "
                f"and {count} bones; export it again."
            )
        joints = np.tile(np.arange(count), (len(weights), 1))
    clips: tuple[RawClip, ...] = ()
    pose = path.with_name(f"{path.stem}-pose.dmat")
    if pose.is_file():
        turned = read_dmat(pose)
        if turned.size != 4 * count:
            raise UserError(f"{pose.name} has {turned.size} numbers for {count} bones of 4; export it again.")
        still = (rest[:, :3, 3])[None]
        clips = (RawClip(
            pose.stem, 0.0, 24.0, still, turned.reshape(1, count, 4), np.ones_like(still), (), np.zeros((1, 0)),
        ),)  # fmt: skip
    return RawRig(
        polygons, tuple(f"bone{row + 1}" for row in range(count)), parents, rest, bind, joints, weights, clips=clips,
    )  # fmt: skip


def read_dmat(path: Path) -> NDArray[np.float64]:
    """The matrix (rows, columns) of a .dmat text file, which stores column after column."""
    words = _text(path).split()
    try:
        columns, rows = int(words[0]), int(words[1])
        values = np.array(words[2:], np.float64)
    except (ValueError, IndexError):
        raise UserError(f"{path.name} is not a text matrix; export it again.") from None
    if rows < 0 or columns < 0 or len(values) != rows * columns:
        raise UserError(f"{path.name} has {len(values)} numbers for {columns} columns of {rows}; it may be cut short.")
    return np.ascontiguousarray(values.reshape(columns, rows).T)


def _text(path: Path) -> str:
    if path.stat().st_size > LARGEST:
        raise UserError(f"{path.name} is larger than {LARGEST >> 20} MB; export a smaller rig.")
    return path.read_bytes().decode("utf-8", "replace")
