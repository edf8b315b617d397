"""``python -m app.compile_kernels``: compiles every kernel into the cache, and says how far it is, line by line."""

from __future__ import annotations

import importlib

from core.kernel_cache import kernel_modules, note_compiled

if __name__ == "__main__":
    names = kernel_modules()
    for number, name in enumerate(names):
        print(number, len(names), flush=True)
        importlib.import_module(name)
    note_compiled()
