"""The one thread pool: numba kernels that release the GIL, run over ranges of rows."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


class Workers:
    """Runs ``call(start, stop)`` over slices of rows. Numba's own threading layers are not used:
    they abort the process when two threads launch at once."""

    def __init__(self, threads: int | None = None) -> None:
        self.threads = max(1, threads if threads is not None else (os.cpu_count() or 1))
        self._pool = ThreadPoolExecutor(self.threads, thread_name_prefix="worker")

    def ranges(self, count: int, call: Callable[[int, int], object], grain: int = 2048) -> None:
        """Cover rows 0..count with calls of at least `grain` rows; returns when all are done.

        An exception of any slice is raised here after the others have ended.
        """
        slices = max(1, min(self.threads, count // max(1, grain)))
        if slices == 1:
            if count:
                call(0, count)
            return
        edges = [count * i // slices for i in range(slices + 1)]
        jobs = [self._pool.submit(call, edges[i], edges[i + 1]) for i in range(1, slices)]
        try:
            call(edges[0], edges[1])
        finally:
            errors = [job.exception() for job in jobs]
        for error in errors:
            if error is not None:
                raise error

    def close(self) -> None:
        self._pool.shutdown()


def serial_ranges(count: int, call: Callable[[int, int], object], grain: int = 2048) -> None:
    """The same as :meth:`Workers.ranges` on the calling thread (for scripts and tests)."""
    if count:
        call(0, count)
