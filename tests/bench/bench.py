"""How a benchmark reports: rows of what, measured, unit and the figure to reach."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import NamedTuple


class Row(NamedTuple):
    """One line of the table. `target` is a bound from above for times and sizes; None is only shown."""

    what: str
    measured: float
    unit: str
    target: float | None = None
    at_least: bool = False


def median_ms(call: Callable[[], object], runs: int = 9, warm: int = 1) -> float:
    """Median wall milliseconds of `call` over `runs`, after `warm` uncounted calls."""
    for _ in range(warm):
        call()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times) * 1e3
