"""Functions which the tests of the sandbox call in a child process: one honest, the others misbehave."""

from __future__ import annotations

import ctypes
import os
import time
from typing import Any, NoReturn

import numpy as np

from core.errors import UserError


def echo(**arguments: Any) -> dict[str, Any]:
    points = np.arange(12, dtype=np.float32).reshape(4, 3)
    return {
        "points": points,
        "turned": points.T,
        "big_endian": points.astype(">f8"),
        "none": np.zeros((0, 3), np.int32),
        "flags": np.array([True, False]),
        "scalar": np.float64(2.5),
        **arguments,
    }


def refuse() -> NoReturn:
    raise UserError("This file has no hair; export curves instead.")


def stumble() -> NoReturn:
    raise ValueError("bad\nheader")


def crash() -> dict[str, Any]:
    return {"read": ctypes.string_at(0)}


def leave() -> NoReturn:
    os._exit(3)


def sleep() -> dict[str, Any]:
    time.sleep(60)
    return {}


def hoard() -> dict[str, Any]:
    return {"rows": np.ones(8 << 30, np.uint8)}


def objects() -> dict[str, Any]:
    return {"rows": np.array([{}, 1], dtype=object)}


def lie(answer_is_beside: str) -> NoReturn:
    """Write an answer whose array is longer than its file."""
    from pathlib import Path

    import msgspec

    from core.formats.sandbox import MAGIC, Answer, Column

    head = msgspec.json.encode(Answer(columns={"rows": Column(dtype=answer_is_beside, shape=(1 << 31, 3), offset=0)}))
    folder = max(Path(os.environ["TMPDIR"]).glob("filoplume-*"), key=lambda p: p.stat().st_mtime)
    (folder / "answer").write_bytes(head + len(head).to_bytes(8, "little") + MAGIC)
    os._exit(0)
