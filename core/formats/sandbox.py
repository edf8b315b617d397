"""Run a native parser in a child process that has limits, can be cancelled and may die.

OpenUSD, Alembic and image decoders are C++ that reads files of strangers. They run here::

    result = run_bounded("core.formats.usd_curves:read_in_child", {"path": "/shots/coat.usdc"},
                         what="coat.usdc", seconds=60, memory=4 << 30)
    result["points"]        # (N, 3) float32, owned and writeable

The target is a function of this program that takes the arguments as keywords and returns a dict whose
values are arrays, strings, numbers, None, or lists and dicts of those. It may raise ``UserError``. The
answer comes back as raw bytes in a temporary file (plain numbers, nothing is ever unpickled) and is
checked before it is believed. On systems without ``resource`` (Windows) only the time limit holds.
"""

from __future__ import annotations

import importlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError

MAGIC = b"FILOBACK"
DTYPES = {"|b1", "|u1", "|i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8"}
BOOT = "import sys; sys.path[:0] = sys.argv[1:]; from core.formats.sandbox import child_main; child_main()"
POLL_SECONDS = 0.01
HEADER_CAP = 64 << 20  # bytes of names and numbers an answer may have beside its arrays


class Request(msgspec.Struct):
    """What the child is asked to do, as one JSON object on its standard input."""

    target: str
    what: str
    arguments: dict[str, Any]
    answer: str
    seconds: float
    memory: int


class Column(msgspec.Struct):
    """One array of an answer: where it lies in the file and what it is."""

    dtype: str
    shape: tuple[int, ...]
    offset: int


class Answer(msgspec.Struct):
    """The head of an answer. `error` is one sentence for the user; `detail` is for a bug report."""

    values: dict[str, Any] = {}
    columns: dict[str, Column] = {}
    error: str | None = None
    detail: str | None = None


def run_bounded(
    target: str,
    arguments: Mapping[str, Any],
    *,
    what: str,
    seconds: float = 60.0,
    memory: int = 4 << 30,
    cancel: Callable[[], bool] | None = None,
) -> dict[str, Any]:
    """Call the function `target` in a child process and return what it returns.

    Parameters
    ----------
    target : "package.module:function", always a fixed word of this program.
    arguments : keywords of the call; anything JSON can say.
    what : the noun of the messages, usually the name of the file.
    seconds, memory : wall and processor time, and address space in bytes, after which the child is ended.
    cancel : asked every 10 ms; True ends the child and raises.

    Returns
    -------
    The dict of the function; arrays are C-contiguous, owned, little endian.

    Raises
    ------
    UserError
        The one of the function, or one that says the file is damaged, took too long, needed too much
        memory or was cancelled. What the child said is attached as a note.
    """
    if not re.fullmatch(r"\w+(\.\w+)*:\w+", target):
        raise ValueError(f"{target} is not package.module:function")
    with tempfile.TemporaryDirectory(prefix="filoplume-", ignore_cleanup_errors=True) as folder:
        answer = Path(folder) / "answer"
        request = Request(
            target=target, what=what, arguments=dict(arguments), answer=str(answer), seconds=seconds, memory=memory
        )
        code = _run_child(msgspec.json.encode(request), what, seconds, cancel)
        if not answer.is_file():
            raise UserError(_obituary(what, code))
        return _receive(answer, what)


def _run_child(request: bytes, what: str, seconds: float, cancel: Callable[[], bool] | None) -> int:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    child = subprocess.Popen(  # our own interpreter and fixed words
        [sys.executable, "-I", "-c", BOOT, *child_paths()],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment,
    )  # fmt: skip
    deadline = time.monotonic() + seconds
    try:
        assert child.stdin is not None
        try:
            child.stdin.write(request)
            child.stdin.close()
        except OSError:  # it died before it listened; its exit code says so below
            pass
        while True:
            try:
                return child.wait(POLL_SECONDS)
            except subprocess.TimeoutExpired:
                pass
            if cancel is not None and cancel():
                raise UserError(f"Reading {what} was cancelled.")
            if time.monotonic() > deadline:
                raise UserError(f"{what} took longer than {seconds:g} seconds to read; it may be damaged or too large.")
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()


def child_paths() -> list[str]:
    """Where a child process finds this program and its libraries."""
    return list(dict.fromkeys(os.path.abspath(p) for p in (str(Path(__file__).resolve().parents[2]), *sys.path)))


def _obituary(what: str, code: int) -> str:
    if code in (-int(getattr(signal, "SIGXCPU", 24)), -int(getattr(signal, "SIGKILL", 9))):
        return f"{what} needed too much time or memory to read; it may be damaged or too large."
    return f"{what} could not be read: it is damaged and its reader failed."


def _receive(path: Path, what: str) -> dict[str, Any]:
    """Read an answer, believing nothing the child wrote that does not fit the size of the file."""
    broken = UserError(f"{what} could not be read: its reader gave no sensible answer.")
    size = path.stat().st_size
    if size < 16:
        raise broken
    with path.open("rb") as file:
        file.seek(size - 16)
        tail = file.read(16)
        length = int.from_bytes(tail[:8], "little")
        if tail[8:] != MAGIC or length > min(size - 16, HEADER_CAP):
            raise broken
        file.seek(size - 16 - length)
        try:
            head = msgspec.json.decode(file.read(length), type=Answer)
        except (msgspec.DecodeError, RecursionError):
            raise broken from None
        if head.error is not None:
            error = UserError(head.error)
            if head.detail:
                error.add_note(head.detail)
            raise error
        result = dict(head.values)
        for name, column in head.columns.items():
            if column.dtype not in DTYPES or min(column.shape, default=0) < 0 or len(column.shape) > 8:
                raise broken
            count = 1
            for extent in column.shape:
                count *= extent
            dtype = np.dtype(column.dtype)
            if column.offset < 0 or column.offset + count * dtype.itemsize > size:
                raise broken
            file.seek(column.offset)
            result[name] = np.fromfile(file, dtype, count).reshape(column.shape)
    return result


def child_main() -> None:
    """Entry of the child process: read the request, set the limits, call, answer."""
    request = msgspec.json.decode(sys.stdin.buffer.read(), type=Request)
    bound_process(request.seconds, request.memory)
    arrays: dict[str, NDArray[Any]] = {}
    try:
        module, _, name = request.target.partition(":")
        result = getattr(importlib.import_module(module), name)(**request.arguments)
        answer = Answer()
        for key, value in result.items():
            if isinstance(value, np.ndarray):
                arrays[key] = np.ascontiguousarray(value, value.dtype.newbyteorder("<"))
            else:
                answer.values[key] = value.item() if isinstance(value, np.generic) else value
        _send(Path(request.answer), answer, arrays)
    except UserError as error:
        _send(Path(request.answer), Answer(error=str(error)), {})
    except MemoryError:
        arrays.clear()
        sentence = f"{request.what} needed too much memory to read; it may be damaged."
        _send(Path(request.answer), Answer(error=sentence), {})
    except Exception as error:  # whatever a native parser throws becomes one sentence here
        reason = " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
        sentence = f"{request.what} could not be read ({reason}); it may be damaged."
        _send(Path(request.answer), Answer(error=sentence, detail=traceback.format_exc()[-4000:]), {})
    os._exit(0)  # destructors of native libraries have nothing left to do for us


def _send(path: Path, answer: Answer, arrays: dict[str, NDArray[Any]]) -> None:
    """Write arrays, then what they are, then a mark; under another name first: half an answer is never seen."""
    beside = path.with_suffix(".part")
    with beside.open("wb") as file:
        for name, array in arrays.items():
            file.write(bytes(-file.tell() % 64))
            answer.columns[name] = Column(dtype=array.dtype.str, shape=array.shape, offset=file.tell())
            if array.size:
                file.write(array.reshape(-1).view(np.uint8).data)
        head = msgspec.json.encode(answer)
        file.write(head + len(head).to_bytes(8, "little") + MAGIC)
    beside.rename(path)


def bound_process(seconds: float, memory: int) -> None:
    """Bound address space, processor time and file size; no core dump; end with the parent where we can."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(1, int(signal.SIGKILL))  # PR_SET_PDEATHSIG
    try:
        import resource
    except ImportError:  # Windows: the parent's clock still ends us
        return
    wanted = {
        resource.RLIMIT_CORE: 0,
        resource.RLIMIT_CPU: int(seconds) + 1,
        resource.RLIMIT_FSIZE: memory,
        resource.RLIMIT_AS: memory,
    }
    for what, limit in wanted.items():
        hard = resource.getrlimit(what)[1]
        bound = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        try:
            resource.setrlimit(what, (bound, bound))
        except (ValueError, OSError):  # macOS refuses some of them
            continue
