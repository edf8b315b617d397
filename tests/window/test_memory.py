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


GIVEN_BACK = """
import resource
import numpy as np
from app.window.memory import give_back_freed_memory, keep_freed_memory

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * resource.getpagesize()

assert keep_freed_memory()
before = resident()
stays, goes = [], []
for _ in range(40):
    goes.append(np.ones(2 << 20, np.uint8))
    stays.append(np.ones(1 << 12, np.uint8))
del goes
kept = resident() - before
assert give_back_freed_memory()
print(kept >> 20, (resident() - before) >> 20)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="of the GNU C library")
def test_what_a_closed_document_took_goes_back_though_small_things_lie_between() -> None:
    done = subprocess.run([sys.executable, "-c", GIVEN_BACK], capture_output=True, text=True, check=True, timeout=60)
    kept, left = map(int, done.stdout.split())
    assert kept > 60
    assert left < 12
