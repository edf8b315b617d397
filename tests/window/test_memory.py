"""Arrays of the size of a preview do not come as fresh pages every time."""

from __future__ import annotations

import subprocess
import sys

import pytest

COUNT = """
import resource
import numpy as np
from app.window.memory import keep_freed_memory
if {kept}:
    assert keep_freed_memory()
guides = np.ones((20_000, 16, 3), np.float32)
for turn in range(30):
    if turn == 10:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    old = new = guides.copy()
    rest = guides.copy()
    del old, new, rest
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(kept: bool) -> int:
    environment = [sys.executable, "-c", COUNT.format(kept=kept)]
    return int(subprocess.run(environment, capture_output=True, text=True, check=True, timeout=60).stdout)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="of the GNU C library")
def test_memory_that_was_freed_is_used_again() -> None:
    assert faults(kept=True) < 40
