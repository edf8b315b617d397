"""Where numba keeps compiled kernels: one folder for each state of their sources.

Numba keys a cached kernel on the text of its own file only, so a kernel inlined from another file would stay stale
after an update. A folder named by a hash over every file with kernels cannot be stale.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from contextlib import suppress
from pathlib import Path

from platformdirs import user_cache_path

KEEP_DAYS = 14


def use_kernel_cache() -> None:
    """Point numba at the folder of these sources, before numba is imported; NUMBA_CACHE_DIR wins where it is set."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    folder = user_cache_path("filoplume") / f"kernels-{source_hash()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        _forget_old(folder)
    except OSError:
        return  # a home that cannot be written to: numba falls back to its own places
    os.environ["NUMBA_CACHE_DIR"] = str(folder)


def source_hash() -> str:
    """A short hash of every source file of core that has to do with numba."""
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for path in _kernel_files():
        digest.update(str(path.relative_to(root)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def kernel_modules() -> tuple[str, ...]:
    """Names of the modules whose import compiles kernels, or loads them when they are in the cache."""
    root = Path(__file__).parent
    found = (path.relative_to(root.parent).with_suffix("").parts for path in _kernel_files())
    return tuple(".".join(parts) for parts in found if parts[-1] != Path(__file__).stem)


def kernels_compiled() -> bool:
    """True when :func:`note_compiled` was called for these sources."""
    note = _note()
    return note is not None and note.exists()


def note_compiled() -> None:
    """All kernels are in the cache now. A folder that cannot be written to is no reason to stop."""
    note = _note()
    if note is not None:
        with suppress(OSError):
            note.touch()


def _note() -> Path | None:
    folder = os.environ.get("NUMBA_CACHE_DIR")
    return Path(folder) / f"compiled-{source_hash()}" if folder else None


def _kernel_files() -> list[Path]:
    return sorted(path for path in Path(__file__).parent.rglob("*.py") if b"numba" in path.read_bytes())


def _forget_old(current: Path) -> None:
    """Remove the folders of sources nobody has run for a while."""
    for folder in current.parent.glob("kernels-*"):
        if folder != current and time.time() - folder.stat().st_mtime > KEEP_DAYS * 86400:
            shutil.rmtree(folder, ignore_errors=True)
