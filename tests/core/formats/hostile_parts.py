"""Parts of files made to hurt, whose checksums are right wherever they should be."""

from __future__ import annotations

import hashlib
import io
import os
import struct
import zipfile

import msgspec
import numpy as np

from core.formats.arrays import ArrayHashes, spec_of
from core.formats.tree import encode_tree
from tests.documents import small_document, small_workspace

DOCUMENT = small_document()
ENCODED = encode_tree(DOCUMENT, small_workspace(), ArrayHashes())
TREE = msgspec.json.decode(ENCODED.json)
POINTS = TREE["document"]["grooms"][0]["guides"]["points"]


def npy(array):
    return spec_of(array).header() + array.tobytes()


def members(tree=None, arrays=None):
    """Members of a project whose checksums all fit."""
    data = msgspec.json.encode(TREE if tree is None else tree) if not isinstance(tree, bytes) else tree
    out = {"document.json": data}
    out |= {f"arrays/{digest}.npy": npy(array) for digest, array in ENCODED.arrays.items()}
    return out | (arrays or {})


def archive(files, compression=zipfile.ZIP_STORED, comment=None):
    """A zip of (name, data) pairs or a dictionary, signed as Filoplume does."""
    pairs = list(files.items()) if isinstance(files, dict) else files
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as file:
        for name, data in pairs:
            file.writestr(name, data)
        tree = dict(pairs).get("document.json", b"")
        file.comment = b"filoplume sha256 " + hashlib.sha256(tree).hexdigest().encode() if comment is None else comment
    return out.getvalue()


def changed(*path, to=None, drop=False):
    """The tree with one value put in another's place."""
    tree = msgspec.json.decode(ENCODED.json)
    at = tree
    for key in path[:-1]:
        at = at[key]
    if drop:
        del at[path[-1]]
    else:
        at[path[-1]] = to
    return archive(members(tree))


def with_array(path, array):
    """The project with another array at a place of the tree, all checksums right."""
    data = npy(array)
    digest = hashlib.sha256(data).hexdigest()
    tree = msgspec.json.decode(ENCODED.json)
    at = tree["document"]
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = digest
    tree["arrays"][digest] = {"dtype": array.dtype.str, "shape": list(array.shape)}
    return archive(members(tree, {f"arrays/{digest}.npy": data}))


def with_member(data):
    """The project with other bytes under the name of its points."""
    return archive(members(arrays={f"arrays/{POINTS}.npy": data}))


def patched(offset_of, value, form="<I"):
    """A good project with a number of its zip structure overwritten."""
    data = bytearray(archive(members()))
    struct.pack_into(form, data, offset_of(data), value)
    return bytes(data)


def end(data):
    return data.rfind(b"PK\5\6")


def quine_overlap():
    """Many members of the list that all point to the same bytes."""
    data = bytearray(archive(members()))
    start = struct.unpack_from("<I", data, end(data) + 16)[0]
    entry = start
    while data[entry : entry + 4] == b"PK\1\2":
        struct.pack_into("<II", data, entry + 20, len(data) // 2, len(data) // 2)
        entry += 46 + sum(struct.unpack_from("<HHH", data, entry + 28))
    return bytes(data)


def hostile_pickle():
    class Boom:
        def __reduce__(self):
            return (os.system, ("touch /tmp/filoplume-was-here",))

    out = io.BytesIO()
    np.save(out, np.array([Boom()], dtype=object), allow_pickle=True)
    return with_member(out.getvalue())


def deep_json(depth):
    nested = b"[" * depth + b"]" * depth
    return archive(members(ENCODED.json[:-1] + b',"deep":' + nested + b"}"))
