"""How long a kind of work usually takes."""

from __future__ import annotations

import time


class Stopwatch:
    """The usual time of the last few pieces of work, in milliseconds."""

    def __init__(self) -> None:
        self.ms = 0.0
        self._start: float | None = None

    def start(self) -> None:
        """The work begins."""
        self._start = time.perf_counter()

    def stop(self) -> float | None:
        """The work is done: its milliseconds, None when it had not begun."""
        if self._start is None:
            return None
        took = 1e3 * (time.perf_counter() - self._start)
        self._start = None
        self.ms = took if self.ms == 0.0 else 0.7 * self.ms + 0.3 * took
        return took
