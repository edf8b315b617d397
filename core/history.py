"""Named steps back and forth. A step is a whole value near the cursor and a packed difference far from it."""

from __future__ import annotations

import threading
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

from core.change import Change, Walk, change_bytes, difference
from core.leaves import leaves
from core.record import Record

Value = TypeVar("Value", bound=Record)
DEFAULT_BUDGET = 1 << 30


class _Step(Generic[Value]):
    """One state. `change` leads here from the step before, once somebody packed it; then `document` may be None."""

    __slots__ = ("change", "document", "name", "packed", "packed_bytes")

    def __init__(self, name: str, document: Value) -> None:
        self.name = name
        self.document: Value | None = document
        self.change: Change | None = None
        self.packed = False
        self.packed_bytes = 0


class History(Generic[Value]):
    """The steps of one document, for undo and redo.

    A value handed in is kept as it is; steps further than `keep` from the cursor are packed on a thread of their own
    as the rows that changed, old XOR new, so they come back to the bit. When `budget` bytes (it may be changed) are
    passed the oldest steps are forgotten; the current one never is.

    Whichever way the cursor lies, a state may lose its whole value only when the change between it and its neighbour
    towards the cursor is packed: so every state can be reached from the current one, which is always whole.
    """

    def __init__(self, document: Value, name: str = "New", budget: int = DEFAULT_BUDGET, keep: int = 20) -> None:
        self._steps: list[_Step[Value]] = [_Step(name, document)]
        self._cursor = 0
        self.budget = budget
        self._keep = keep
        self._lock = threading.Lock()
        self._packer = ThreadPoolExecutor(1, thread_name_prefix="history")
        self._packing: Future[None] | None = None

    @property
    def current(self) -> Value:
        """The value at the cursor."""
        document = self._steps[self._cursor].document
        assert document is not None  # the invariant of the class
        return document

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all steps, oldest first; the first is the state the history began with (or still remembers)."""
        with self._lock:
            return tuple(step.name for step in self._steps)

    @property
    def cursor(self) -> int:
        """Place of the current step in `names`."""
        return self._cursor

    @property
    def undo_name(self) -> str | None:
        """Name of what undo would take back, or None."""
        with self._lock:
            return self._steps[self._cursor].name if self._cursor else None

    @property
    def redo_name(self) -> str | None:
        """Name of what redo would bring back, or None."""
        with self._lock:
            return self._steps[self._cursor + 1].name if self._cursor + 1 < len(self._steps) else None

    @property
    def bytes(self) -> int:
        """Bytes of the distinct arrays held, whole and packed."""
        with self._lock:
            return self._bytes()

    def commit(self, name: str, document: Value) -> None:
        """Add a step after the cursor; what could be redone is gone. The current value again adds nothing."""
        if document is self.current:
            return
        with self._lock:
            del self._steps[self._cursor + 1 :]
            self._steps.append(_Step(name, document))
            self._cursor += 1
            crowded = sum(step.document is not None for step in self._steps) > 4 * self._keep + 8
        self._start_packing(forget=True)
        if crowded:  # strokes come faster than they can be packed: memory matters more than this one's time
            self.flush()

    def undo(self) -> Value:
        """Step back and return the value there (the current one when there is nothing to undo)."""
        return self.jump(max(0, self._cursor - 1))

    def redo(self) -> Value:
        """Step forward and return the value there (the current one when there is nothing to redo)."""
        return self.jump(min(len(self._steps) - 1, self._cursor + 1))

    def jump(self, place: int) -> Value:
        """Go to a place in `names` and return the value there; IndexError when there is none."""
        with self._lock:
            if not 0 <= place < len(self._steps):
                raise IndexError(f"there is no step {place} among {len(self._steps)}")
            target = self._steps[place]
            if target.document is None:
                target.document = self._rebuild(place)
            self._cursor = place
            document = target.document
        self._start_packing(forget=False)  # who only looks back and forth loses no step by it
        return document

    def flush(self) -> None:
        """Wait until everything far from the cursor is packed."""
        if self._packing is not None:
            self._packing.result()

    def close(self) -> None:
        """End the packing thread. The steps stay usable as they are."""
        self._packer.shutdown(wait=True, cancel_futures=True)
        self._packing = None

    def _rebuild(self, place: int) -> Value:
        forward = place > self._cursor
        way = range(self._cursor + 1, place + 1) if forward else range(self._cursor - 1, place - 1, -1)
        walk = Walk(self.current)
        for i in way:
            document = self._steps[i].document
            if document is not None:
                walk = Walk(document)
            else:
                walk.step(self._steps[i if forward else i + 1].change, forward)
        value: Value = walk.value()
        return value

    def _bytes(self) -> int:
        whole = {id(a): a.nbytes for step in self._steps if step.document is not None for _, a in leaves(step.document)}
        return sum(whole.values()) + sum(step.packed_bytes for step in self._steps)

    def _start_packing(self, forget: bool) -> None:
        # always a new job, for the last one may just be ending; one that finds nothing to do costs nothing
        try:
            self._packing = self._packer.submit(self._pack, forget)
        except RuntimeError:  # closed
            self._packing = None

    def _pack(self, forget: bool) -> None:
        while True:
            with self._lock:
                far = self._farthest_whole()
                if far is None:
                    if forget:
                        self._forget()
                    return
                place, near = far
                older, newer = sorted((place, near))
                step, before, after = self._steps[place], self._steps[older].document, self._steps[newer]
                document = after.document
            if not after.packed and before is not None and document is not None:
                change = difference(before, document)  # outside the lock: both are immutable
                size = change_bytes(change)
                with self._lock:
                    after.change, after.packed, after.packed_bytes = change, True, size
            if not after.packed:  # cannot be, by the invariant; rather keep memory than turn for ever
                return
            with self._lock:
                # the cursor may have moved meanwhile
                if self._farthest_whole() == (place, near) and self._steps[place] is step and after.packed:
                    step.document = None

    def _farthest_whole(self) -> tuple[int, int] | None:
        """A whole state beyond reach of the cursor, farthest first, and its neighbour towards the cursor."""
        for i in range(max(0, self._cursor - self._keep)):
            if self._steps[i].document is not None:
                return i, i + 1
        for i in range(len(self._steps) - 1, self._cursor + self._keep, -1):
            if self._steps[i].document is not None:
                return i, i - 1
        return None

    def _forget(self) -> None:
        while len(self._steps) > 1 and self._bytes() > self.budget:
            if self._cursor:
                del self._steps[0]
                self._cursor -= 1
                first = self._steps[0]
                first.change, first.packed, first.packed_bytes = None, False, 0
                if first.document is None:
                    continue
            else:
                del self._steps[-1]
