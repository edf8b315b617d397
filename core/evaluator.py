"""The evaluator: remembers what pure functions made of immutable inputs."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

import numpy as np

from core.leaves import leaves
from core.record import is_frozen
from core.workers import Workers

Result = TypeVar("Result")
Key = tuple[Any, ...]
DEFAULT_BUDGET = 1 << 30


class _Entry:
    __slots__ = ("alive", "bytes", "inputs", "value")

    def __init__(self, value: Any, size: int) -> None:
        self.value, self.bytes, self.alive = value, size, True
        self.inputs: tuple[Callable[[], Any], ...] = ()


class Evaluator:
    """Derived data by the identity of what it was derived from, within `budget` bytes; used from any thread.

    workers : the one pool of threads.
    """

    def __init__(self, budget: int = DEFAULT_BUDGET, workers: Workers | None = None) -> None:
        self.workers = workers if workers is not None else Workers()
        self._budget = budget
        self._used = 0
        self._entries: OrderedDict[Key, _Entry] = OrderedDict()
        self._dead: deque[tuple[Key, _Entry]] = deque()
        self._lock = threading.Lock()

    def get(self, function: Callable[..., Result], *inputs: Any, **parameters: Hashable) -> Result:
        """``function(*inputs, **parameters)``, from memory when these very inputs were given before.

        Parameters
        ----------
        function : pure; its value must not be written to. It is called outside the lock, so two threads may
            compute the same thing at once; both then get the same value.
        inputs : records or read-only arrays (every array under a view too), compared by identity; None is allowed.
        parameters : hashable, compared by equality.

        Raises
        ------
        TypeError
            An input that cannot be remembered by identity (a number, a tuple): pass it as a parameter.
        ValueError
            An input array somebody could still write to.
        """
        for value in inputs:
            _check_input(value)
        # type beside value: 1, 1.0 and True are equal and hash alike
        plain = tuple((name, type(value), value) for name, value in sorted(parameters.items()))
        key = (function, plain, tuple(map(id, inputs)))
        with self._lock:
            self._bury()
            found = self._find(key, inputs)
            if found is not None:
                return found.value
        value = function(*inputs, **parameters)
        entry = _Entry(value, _size(value))
        with self._lock:
            self._bury()
            found = self._find(key, inputs)  # another thread may have been quicker: one value for all
            if found is not None:
                return found.value
            self._remove(key)
            entry.inputs = tuple(self._reference(v, key, entry) for v in inputs)
            self._entries[key] = entry
            self._used += entry.bytes
            while self._used > self._budget and self._entries:
                self._remove(next(iter(self._entries)))
        return value

    def knows(self, function: Callable[..., Any], *inputs: Any, **parameters: Hashable) -> bool:
        """True when :meth:`get` would answer at once."""
        plain = tuple((name, type(value), value) for name, value in sorted(parameters.items()))
        with self._lock:
            self._bury()
            return self._find((function, plain, tuple(map(id, inputs))), inputs) is not None

    def forget(self) -> None:
        """Drop everything remembered."""
        with self._lock:
            for key in list(self._entries):
                self._remove(key)

    @property
    def bytes(self) -> int:
        """Bytes of the values remembered."""
        with self._lock:
            self._bury()
            return self._used

    def __len__(self) -> int:
        with self._lock:
            self._bury()
            return len(self._entries)

    def close(self) -> None:
        """Forget everything and end the threads."""
        self.forget()
        self.workers.close()

    def _find(self, key: Key, inputs: tuple[Any, ...]) -> _Entry | None:
        entry = self._entries.get(key)
        # an id alone proves nothing: it may belong to a successor of a dead input
        if entry is None or not all(ref() is value for ref, value in zip(entry.inputs, inputs, strict=True)):
            return None
        self._entries.move_to_end(key)
        return entry

    def _reference(self, value: Any, key: Key, entry: _Entry) -> Callable[[], Any]:
        if value is None:
            return lambda: None
        # The callback may come at any moment, inside our own lock too: it only leaves a note.
        return weakref.ref(value, lambda _: self._dead.append((key, entry)))

    def _bury(self) -> None:
        while self._dead:
            key, entry = self._dead.popleft()
            if self._entries.get(key) is entry:  # not a successor under the same key
                self._remove(key)

    def _remove(self, key: Key) -> None:
        entry = self._entries.pop(key, None)
        if entry is not None and entry.alive:
            entry.alive = False
            self._used -= entry.bytes


def _check_input(value: Any) -> None:
    if value is None:
        return
    if isinstance(value, np.ndarray):
        if not is_frozen(value):
            raise ValueError("an input of the evaluator can still be written to: freeze() it first")
    elif type(value).__weakrefoffset__ == 0:
        raise TypeError(f"a {type(value).__name__} has no identity to remember it by: pass it as a named parameter")


def _size(value: Any, depth: int = 4) -> int:
    """Bytes of the arrays in a value: records, containers, plain objects of libraries (scipy's sparse, trees)."""
    total = 256
    if depth == 0:
        return total
    own = getattr(value, "nbytes", None)
    if isinstance(own, int | np.integer):
        return total + int(own)
    if isinstance(value, tuple | list | set):
        return total + sum(_size(v, depth - 1) for v in value)
    if isinstance(value, dict):
        return total + sum(_size(v, depth - 1) for v in value.values())
    counted = {id(a): a.nbytes for _, a in leaves(value)}
    if not counted:
        members = vars(value).values() if hasattr(value, "__dict__") else ()
        return total + sum(_size(v, depth - 1) for v in members)
    return total + sum(counted.values())
