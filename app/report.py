"""What a command tells while it works: stages with their seconds, a progress bar, the result."""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


class Report:
    """Stages of one command, shown as a bar on a terminal, kept for ``--json``."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json
        self.seconds: dict[str, float] = {}
        self.console = Console(stderr=True)
        self._bar: Progress | None = None

    @contextmanager
    def working(self, total: int) -> Iterator[None]:
        """Show the bar (only on a terminal) while the `total` stages inside run."""
        if not self.console.is_terminal:
            yield
            return
        columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(bar_width=28), TimeElapsedColumn())
        with Progress(*columns, console=self.console, transient=True) as self._bar:
            self._task = self._bar.add_task("", total=total)
            yield
        self._bar = None

    @contextmanager
    def stage(self, name: str, words: str = "") -> Iterator[None]:
        """Time what runs inside as `name`."""
        if self._bar:
            self._bar.update(self._task, description=words or name)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = round(self.seconds.get(name, 0.0) + time.perf_counter() - start, 4)
            if self._bar:
                self._bar.advance(self._task)

    def words(self, words: str) -> None:
        """Say beside the bar what goes on in the stage at hand."""
        if self._bar:
            self._bar.update(self._task, description=words)

    def note(self, words: str) -> None:
        """A word the person should read; never on standard output when that carries JSON."""
        if self._bar:
            self._bar.console.print(f"note: {words}", highlight=False)
        else:
            print(f"note: {words}", file=sys.stderr)

    def done(self, result: dict[str, Any], lines: list[str]) -> None:
        """Print the result: one JSON object, or the `lines` for a person."""
        print(json.dumps(result) if self.as_json else "\n".join(lines))


def peak_megabytes() -> float:
    """Largest resident size of this process so far, in megabytes."""
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(size / (1024.0 * 1024.0 if sys.platform == "darwin" else 1024.0), 1)
