"""How long a kind of work usually takes."""

from __future__ import annotations

import statistics
import time
from collections import deque

LAST = 5  # pieces of work; one that took long for once does not count


class Stopwatch:
    """The usual time of the last few pieces of work, in milliseconds."""

    def __init__(self) -> None:
        self._last: deque[float] = deque(maxlen=LAST)
        self._start: float | None = None

    @property
    def ms(self) -> float:
        """The median; 0 before any."""
        return statistics.median(self._last) if self._last else 0.0

    def start(self) -> None:
        """The work begins."""
        self._start = time.perf_counter()

    def stop(self) -> float | None:
        """The work is done: its milliseconds, None when it had not begun."""
        if self._start is None:
            return None
        took = 1e3 * (time.perf_counter() - self._start)
        self._start = None
        self._last.append(took)
        return took
