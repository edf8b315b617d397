"""How the program asks the system for memory: what a preview of a stroke frees, the next one takes."""

from __future__ import annotations

import ctypes
import sys

# of malloc.h of the GNU C library
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
LARGEST_KEPT = 32 << 20  # bytes of one array; the most the library takes
MOST_KEPT = 128 << 20  # bytes free at the end of the heap


def keep_freed_memory() -> bool:
    """Let arrays up to LARGEST_KEPT come from memory that was freed before; True where the system can do so.

    The GNU C library hands every large array fresh pages of the system and gives them back at once: to 20,000 guides
    copied for a preview that costs more than the copying. Other systems keep such memory by themselves.
    """
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    return bool(mallopt(M_MMAP_THRESHOLD, LARGEST_KEPT)) and bool(mallopt(M_TRIM_THRESHOLD, MOST_KEPT))
