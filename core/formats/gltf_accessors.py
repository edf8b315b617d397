"""Accessors of glTF: numbers in buffers, strided, sparse or normalised, believed only within their bounds."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Buffer(msgspec.Struct, rename="camel"):
    byte_length: int = 0
    uri: str | None = None


class BufferView(msgspec.Struct, rename="camel"):
    buffer: int
    byte_length: int
    byte_offset: int = 0
    byte_stride: int | None = None


class SparseIndices(msgspec.Struct, rename="camel"):
    buffer_view: int
    component_type: int
    byte_offset: int = 0


class SparseValues(msgspec.Struct, rename="camel"):
    buffer_view: int
    byte_offset: int = 0


class Sparse(msgspec.Struct):
    count: int
    indices: SparseIndices
    values: SparseValues


class Accessor(msgspec.Struct, rename="camel"):
    component_type: int
    count: int
    type: str
    buffer_view: int | None = None
    byte_offset: int = 0
    normalized: bool = False
    sparse: Sparse | None = None


def read_accessor(
    accessor: Accessor, views: list[BufferView], buffers: list[bytes], width: int
) -> NDArray[np.float64]:
    """The values of an accessor, (count, width) float64, writeable.

    Raises
    ------
    ValueError
        When it is of another width, or reaches beyond its buffer.
    """
    if accessor.component_type not in COMPONENTS or WIDTHS.get(accessor.type) != width:
        raise ValueError("an accessor has a type that does not fit its use")
    kind = np.dtype(COMPONENTS[accessor.component_type])
    if accessor.buffer_view is None:
        largest = sum(len(buffer) for buffer in buffers) * 64  # zeros cost nothing in a file, so they are bounded
        if not 0 <= accessor.count <= max(largest, 1 << 16):
            raise ValueError("an accessor without values is too long")
        values = np.zeros((accessor.count, width), kind)
    else:
        values = _strided(views, buffers, accessor.buffer_view, accessor.byte_offset, accessor.count, width, kind)
    if accessor.sparse is not None:
        values = values.copy()
        sparse = accessor.sparse
        if sparse.indices.component_type not in (5121, 5123, 5125):
            raise ValueError("sparse indices have a wrong type")
        index_kind = np.dtype(COMPONENTS[sparse.indices.component_type])
        at = sparse.indices
        rows = _strided(views, buffers, at.buffer_view, at.byte_offset, sparse.count, 1, index_kind)[:, 0]
        if len(rows) and rows.max() >= len(values):
            raise ValueError("sparse indices lie outside their accessor")
        values[rows] = _strided(
            views, buffers, sparse.values.buffer_view, sparse.values.byte_offset, sparse.count, width, kind
        )
    out = values.astype(np.float64)
    if accessor.normalized and kind.kind in "iu":
        out = np.maximum(out / float(np.iinfo(kind).max), -1.0)
    return out


def _strided(
    views: list[BufferView], buffers: list[bytes], row: int, offset: int, count: int, width: int, kind: np.dtype
) -> NDArray:
    if not 0 <= row < len(views) or not 0 <= views[row].buffer < len(buffers):
        raise ValueError("a buffer view does not exist")
    view = views[row]
    item = width * kind.itemsize
    stride = item if view.byte_stride is None else view.byte_stride
    data = buffers[view.buffer]
    end = view.byte_offset + view.byte_length
    start = view.byte_offset + offset
    last = start + (count - 1) * stride + item if count else start
    if min(offset, view.byte_offset, view.byte_length, count) < 0 or stride < item or last > end or end > len(data):
        raise ValueError("an accessor reaches beyond its buffer")
    if not count:
        return np.zeros((0, width), kind)
    rows = np.lib.stride_tricks.as_strided(
        np.frombuffer(data, np.uint8, last - start, start), (count, item), (stride, 1), writeable=False
    )
    return np.ascontiguousarray(rows).view(kind).reshape(count, width)
