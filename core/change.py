"""The difference of two trees of records, small, and good for going either way.

Whatever is the same object on both sides costs nothing and stays the same object after going there and back, so the
rest of the program still sees by ``is`` what a step touched.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from core.leaves import array_bytes
from core.record import Record, freeze
from core.rows import RowChange, bytes_of_rows, flip_rows, row_change


class Swap(NamedTuple):
    """Both values whole."""

    old: Any
    new: Any


class Splice(NamedTuple):
    """Rows of an array, or members of a tuple, `start` .. in which the two sides differ in number."""

    start: int
    old: Any
    new: Any


class Parts(NamedTuple):
    """Changes of some fields of a record or some places of a tuple."""

    changes: tuple[tuple[Any, Any], ...]


Change = Swap | Splice | Parts | RowChange


def difference(old: Any, new: Any) -> Change | None:
    """How `new` differs from `old`; None when it is the same object."""
    if old is new:
        return None
    if isinstance(old, np.ndarray) and isinstance(new, np.ndarray):
        return _array_difference(old, new)
    if isinstance(old, Record) and type(old) is type(new):
        pairs: list[tuple[str | int, Change | None]] = [
            (name, difference(getattr(old, name), getattr(new, name))) for name in old.__struct_fields__
        ]
    elif isinstance(old, tuple) and isinstance(new, tuple):
        if len(old) != len(new):
            return _tuple_splice(old, new)
        pairs = [(i, difference(a, b)) for i, (a, b) in enumerate(zip(old, new, strict=True))]
    else:
        return Swap(old, new)
    return Parts(tuple((key, change) for key, change in pairs if change is not None))


def _array_difference(old: np.ndarray, new: np.ndarray) -> Change:
    if old.dtype != new.dtype or old.ndim == 0 or old.shape[1:] != new.shape[1:] or not (old.size and new.size):
        return Swap(old, new)
    if len(old) == len(new):
        return row_change(old, new)
    # rows were added or taken away: what lies before and after them is often the same
    shorter = min(len(old), len(new))
    a, b = bytes_of_rows(old), bytes_of_rows(new)
    head = _count_equal(a[:shorter], b[:shorter])
    rest = shorter - head
    tail = _count_equal(a[len(a) - rest :][::-1], b[len(b) - rest :][::-1])
    if head + tail < shorter // 4:
        return Swap(old, new)
    # copies, so that the whole arrays can go
    return Splice(head, freeze(old[head : len(old) - tail].copy()), freeze(new[head : len(new) - tail].copy()))


def _count_equal(a: np.ndarray, b: np.ndarray) -> int:
    differ = (a != b).any(axis=1)
    return int(differ.argmax()) if differ.any() else len(differ)


def _tuple_splice(old: tuple[Any, ...], new: tuple[Any, ...]) -> Change:
    shorter = min(len(old), len(new))
    head = 0
    while head < shorter and old[head] is new[head]:
        head += 1
    tail = 0
    while tail < shorter - head and old[-1 - tail] is new[-1 - tail]:
        tail += 1
    return Splice(head, old[head : len(old) - tail], new[head : len(new) - tail])


def change_bytes(change: Change | None) -> int:
    """Bytes a change keeps in memory (its arrays)."""
    if change is None:
        return 0
    if isinstance(change, RowChange):
        return change.nbytes
    if isinstance(change, Parts):
        return sum(change_bytes(part) for _, part in change.changes) + 64 * len(change.changes)
    return array_bytes(change.old, change.new)


class _Open:
    """A record or tuple taken apart while changes are applied, so that many can be at the cost of one."""

    __slots__ = ("origin", "parts")

    def __init__(self, origin: Any) -> None:
        self.origin = origin
        self.parts: dict[Any, Any] = (
            dict(enumerate(origin))
            if isinstance(origin, tuple)
            else {n: getattr(origin, n) for n in origin.__struct_fields__}
        )


class Walk:
    """Goes from one value to another through a chain of changes. Arrays are copied once, then changed in place."""

    def __init__(self, value: Any) -> None:
        self._node = value

    def step(self, change: Change | None, forward: bool) -> None:
        """Apply one change, from its old to its new side when `forward`."""
        self._node = _apply(self._node, change, forward)

    def value(self) -> Any:
        """The value reached, frozen; ends the walk."""
        return _close(self._node)


def _apply(node: Any, change: Change | None, forward: bool) -> Any:
    if change is None:
        return node
    if isinstance(change, Swap):
        return change.new if forward else change.old
    if isinstance(change, RowChange):
        if not len(change.rows):
            return node
        array = node if node.flags.writeable else node.copy()  # a writable array can only be our own copy
        flip_rows(array, change)
        return array
    if isinstance(change, Parts):
        opened = node if isinstance(node, _Open) else _Open(node)
        for key, part in change.changes:
            opened.parts[key] = _apply(opened.parts[key], part, forward)
        return opened
    here, there = (change.old, change.new) if forward else (change.new, change.old)
    if isinstance(here, tuple):
        have = tuple(node.parts.values()) if isinstance(node, _Open) else node
        opened = _Open(())
        opened.parts = dict(enumerate((*have[: change.start], *there, *have[change.start + len(here) :])))
        return opened
    return np.concatenate([node[: change.start], there, node[change.start + len(here) :]])


def _close(node: Any) -> Any:
    if isinstance(node, np.ndarray):
        return freeze(node)
    if not isinstance(node, _Open):
        return node
    parts = {key: _close(part) for key, part in node.parts.items()}
    if isinstance(node.origin, tuple):
        return tuple(parts.values())
    if all(part is getattr(node.origin, key) for key, part in parts.items()):
        return node.origin
    return type(node.origin)(**parts)
