"""The project file .filo: a zip of stored members, document.json and one .npy for every distinct array.

An array's member is named by the SHA-256 of its bytes, the hash of document.json is the comment of the zip: what is
read is what was written. Nothing in it is code; a project can be read with unzip, a text editor and numpy.
"""

from __future__ import annotations

import hashlib
import os
import re
import struct
import zipfile
import zlib
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from core.document import Document, problems
from core.errors import UserError
from core.formats.arrays import ArrayHashes, ArraySpec, array_from, raw_bytes, spec_of
from core.formats.atomic import atomic_write
from core.formats.tree import LARGEST_TREE, MOST_ARRAYS, Encoded, Envelope, decode_envelope, decode_part, encode_tree
from core.groom.groom import Coat
from core.pose.rig import control_names
from core.value import Constant
from core.workspace import Workspace

TREE = "document.json"
_MEMBER = re.compile(r"arrays/([0-9a-f]{64})\.npy")
_COMMENT = b"filoplume sha256 "
_DATE = (1980, 1, 1, 0, 0, 0)  # equal documents make equal files
# what zipfile raises on hostile files
_BROKEN = (
    zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError, ValueError, struct.error, EOFError,
    OverflowError, IndexError, KeyError, zlib.error,
)  # fmt: skip


class Project(NamedTuple):
    """What a project file holds."""

    document: Document
    workspace: Workspace


def write_project(
    path: str | os.PathLike[str], document: Document, workspace: Workspace | None = None,
    hashes: ArrayHashes | None = None,
) -> None:
    """Save a project; the file it replaces is kept as ``.filo1``.

    Written beside, fsynced, read back and compared, then put in place in one step.

    Raises
    ------
    UserError
        It could not be saved; the earlier file is untouched.
    """
    tree = encode_tree(document, workspace or Workspace(), hashes or ArrayHashes())
    with atomic_write(path, keep_previous=True) as temp:
        with open(temp, "wb") as file:
            _write_members(file, tree)
            file.flush()
            os.fsync(file.fileno())
        if not _reads_back(temp, tree):
            raise UserError(f"{path} could not be saved, the disk gave back something else: save to another disk.")


def read_project(path: str | os.PathLike[str], hashes: ArrayHashes | None = None) -> Project:
    """Open a project. Arrays come back read-only, shared where they were shared.

    Raises
    ------
    UserError
        One sentence: what is wrong with the file.
    """
    name = Path(path).name
    try:
        with open(path, "rb") as file, _open_zip(file) as archive:
            envelope = _read_tree(archive)
            arrays = {digest: _read_array(archive, digest, spec) for digest, spec in envelope.table.items()}
        document = decode_part(envelope, "document", Document, arrays)
        workspace = decode_part(envelope, "workspace", Workspace, arrays)
    except (OSError, *_BROKEN) as error:
        raise UserError(_sentence(path, error)) from error
    found = problems(document)
    if found:
        raise UserError(f"{name} cannot be opened: {found[0]}")
    if hashes is not None:
        for digest, array in arrays.items():
            hashes.remember(array, digest)
    return Project(document, workspace)


def check_project(path: str | os.PathLike[str]) -> list[str]:
    """Everything that is wrong with a project file, one sentence each; empty when it is whole."""
    found: list[str] = []
    arrays: dict[str, np.ndarray] = {}
    try:
        with open(path, "rb") as file, _open_zip(file) as archive:
            envelope = _read_tree(archive)
            for digest, spec in envelope.table.items():
                try:
                    arrays[digest] = _read_array(archive, digest, spec)
                except (OSError, *_BROKEN) as error:
                    found.append(f"Array {digest[:12]}: {error}.")
            unused = {info.filename for info in archive.infolist()} - {_member(d) for d in envelope.table} - {TREE}
            found.extend(f"The member {unknown} is not in the table." for unknown in sorted(unused))
        if len(arrays) == len(envelope.table):
            decode_part(envelope, "workspace", Workspace, arrays)
            found.extend(problems(decode_part(envelope, "document", Document, arrays)))
    except (OSError, *_BROKEN) as error:
        found.append(_sentence(path, error))
    return found


def project_info(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Counts of a project file for people and scripts; UserError when it cannot be opened."""
    document = read_project(path).document
    return {
        "kind": "project",
        "unit": document.unit,
        "parts": [item.name for item in document.meshes],
        "vertices": sum(len(item.mesh.points) for item in document.meshes),
        "faces": sum(len(item.mesh.counts) for item in document.meshes),
        "controls": [name for item in document.meshes if item.rig is not None for name in control_names(item.rig)],
        "grooms": [groom.name for groom in document.grooms],
        "feathers": [coat.name for coat in document.feathers],
        "guides": sum(len(groom.guides) for groom in document.grooms),
        "hairs": sum(_hairs(groom.coat) for groom in document.grooms),
        "bytes": os.path.getsize(path),
        "problems": [],
    }


def _hairs(coat: Coat) -> int:
    """Hairs shown; of a density that differs from hair to hair, which only growing can tell, all that are grown."""
    density = coat.density.base
    if isinstance(density, Constant) and coat.density.map is None:
        return ceil(coat.count * density.number - 1e-9)
    return coat.count


def _member(digest: str) -> str:
    return f"arrays/{digest}.npy"


def _members(tree: Encoded) -> list[tuple[str, list[Any]]]:
    """Name and buffers of every member, in the order of the file."""
    arrays = [(_member(d), [spec_of(a).header(), raw_bytes(a)]) for d, a in tree.arrays.items()]
    return [(TREE, [tree.json]), *arrays]


def _write_members(file: Any, tree: Encoded) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        archive.comment = _COMMENT + hashlib.sha256(tree.json).hexdigest().encode()
        for name, buffers in _members(tree):
            info = zipfile.ZipInfo(name, _DATE)
            info.file_size = sum(len(b) for b in buffers)
            with archive.open(info, "w", force_zip64=info.file_size > 1 << 30) as member:
                for buffer in buffers:
                    member.write(buffer)


def _reads_back(path: Path, tree: Encoded) -> bool:
    """True when the file on disk holds, byte for byte, what was to be written."""
    try:
        with open(path, "rb") as file, _open_zip(file) as archive:
            for name, buffers in _members(tree):
                file.seek(_data_offset(file, archive.getinfo(name)))
                for buffer in buffers:
                    want = np.frombuffer(buffer, np.uint8)
                    if not np.array_equal(np.frombuffer(file.read(len(want)), np.uint8), want):
                        return False
    except _BROKEN:
        return False
    return True


def _data_offset(file: Any, info: zipfile.ZipInfo) -> int:
    file.seek(info.header_offset + 26)
    name, extra = struct.unpack("<HH", file.read(4))
    return int(info.header_offset + 30 + name + extra)


def _open_zip(file: Any) -> zipfile.ZipFile:
    """Open and check the list of members: only ours, stored, once each, within the file."""
    size = file.seek(0, os.SEEK_END)
    announced = _check_directory(file, size)
    archive = zipfile.ZipFile(file)
    if len(archive.infolist()) != announced:
        raise ValueError("its list of members is damaged")
    names: set[str] = set()
    total = 0
    for info in archive.infolist():
        if info.filename != TREE and not _MEMBER.fullmatch(info.filename):
            raise ValueError(f"it holds {info.filename[:80]!r}, which does not belong in a project")
        if info.filename in names:
            raise ValueError(f"it holds {info.filename[:24]} twice")
        if info.compress_type != zipfile.ZIP_STORED or info.flag_bits & 1 or info.file_size != info.compress_size:
            raise ValueError("its members are compressed or encrypted, which Filoplume never does")
        names.add(info.filename)
        total += info.file_size
        if total > size or info.header_offset < 0 or info.header_offset + info.file_size > size:
            raise ValueError("its members are larger than the file")
    if TREE not in names:
        raise ValueError(f"it holds no {TREE}")
    return archive


def _check_directory(file: Any, size: int) -> int:
    """Refuse an over-long list of members before zipfile makes an object of each; looks where zipfile looks.

    Returns how many members the list is said to have.
    """
    file.seek(max(0, size - 65_557 - 76))
    tail = file.read()
    end = tail.rfind(b"PK\5\6")
    if end < 0 or len(tail) < end + 22:
        raise ValueError("it is not a Filoplume project, or its end is missing")
    count, length = struct.unpack_from("<HI", tail, end + 10)
    if end >= 76 and tail[end - 20 : end - 16] == b"PK\6\7":
        count, length = struct.unpack_from("<QQ", tail, end - 76 + 32)
    if length > 256 * (MOST_ARRAYS + 1):
        raise ValueError("it holds too many members")
    return int(count)


def _read_tree(archive: zipfile.ZipFile) -> Envelope:
    info = archive.getinfo(TREE)
    if info.file_size > LARGEST_TREE:
        raise ValueError("its description is too large")
    data = archive.read(info)
    if archive.comment != _COMMENT + hashlib.sha256(data).hexdigest().encode():
        raise ValueError("its description does not match its checksum")
    return decode_envelope(data)


def _read_array(archive: zipfile.ZipFile, digest: str, spec: ArraySpec) -> np.ndarray:
    try:
        info = archive.getinfo(_member(digest))
    except KeyError:
        raise ValueError("an array is missing") from None
    if info.file_size != len(spec.header()) + spec.nbytes:
        raise ValueError("an array has another size than the table says")
    data = archive.read(info)
    if hashlib.sha256(data).hexdigest() != digest:
        raise ValueError("an array does not match its checksum")
    return array_from(data, spec)


def _sentence(path: str | os.PathLike[str], error: Exception) -> str:
    name = Path(path).name
    if isinstance(error, OSError):
        return f"{name} cannot be opened: {error.strerror or error}."
    before = f" The version before it is kept as {name}1." if os.path.exists(os.fspath(path) + "1") else ""
    return f"{name} cannot be opened: {str(error) or type(error).__name__}.{before}"
