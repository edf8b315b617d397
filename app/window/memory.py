"""How the program asks the system for memory: what a preview of a stroke frees, the next one takes; what a closed
document frees goes back."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable

# of malloc.h of the GNU C library
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
LARGEST_KEPT = 32 << 20  # bytes of one array; the most the library takes
MOST_KEPT = 128 << 20  # bytes free at the end of the heap


def keep_freed_memory() -> bool:
    """Let arrays up to LARGEST_KEPT come from memory that was freed before; True where the system can do so.

    The GNU C library hands every large array fresh pages of the system and gives them back at once: to 20,000 guides
    copied for a preview that costs more than the copying. Other systems keep such memory by themselves.
    """
    mallopt = _of_the_c_library("mallopt")
    return bool(mallopt and mallopt(M_MMAP_THRESHOLD, LARGEST_KEPT) and mallopt(M_TRIM_THRESHOLD, MOST_KEPT))


def give_back_freed_memory() -> bool:
    """Give the system all whole pages that are free, wherever they lie; True where that can be asked for.

    What a document and its pictures took lies between small things that stay, so it does not go by itself.
    """
    trim = _of_the_c_library("malloc_trim")
    return bool(trim and trim(ctypes.c_size_t(0)))


def _of_the_c_library(name: str) -> Callable[..., int] | None:
    """A function of the GNU C library, or None on systems that have another."""
    found: Callable[..., int] | None = None
    if sys.platform.startswith("linux"):
        found = getattr(ctypes.CDLL(None), name, None)
    return found
