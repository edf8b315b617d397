"""Reading journals after a crash: the newest state whose arrays all check. Nothing here ever stops a start."""

from __future__ import annotations

import fcntl
import hashlib
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from core.document import Document, problems
from core.formats.arrays import ArraySpec, array_from
from core.formats.journal import COMMIT, DELTA, DELTA_HEADER, HEADER, HEADER_SIZE, LOCK, MAGIC, OBJECT, SUFFIXES
from core.formats.tree import LARGEST_TREE, decode_envelope, decode_part
from core.workspace import Workspace

MOST_TRIED = 1000  # intact commits looked at before a file is given up
LARGEST_JOURNAL = 16 << 30
_CHAIN_LIMIT = 256


class Recovered(NamedTuple):
    """The newest whole state of a journal.

    name : of its last step. time : seconds since 1970 of that step. project : the file it belongs to, or None.
    saved : True when this very state is in that file already.
    """

    document: Document
    workspace: Workspace
    name: str
    sequence: int
    time: float
    project: str | None
    saved: bool
    token: str


class _About(msgspec.Struct, frozen=True):
    sequence: int
    name: str
    time: float
    project: str | None
    saved: bool


class _Piece(NamedTuple):
    """A record found in a file: `data` is the whole file."""

    kind: int
    data: bytes
    start: int
    length: int
    digest: bytes

    def payload(self) -> bytes | None:
        """The payload when it is what was written, else None."""
        payload = self.data[self.start : self.start + self.length]
        return payload if hashlib.sha256(payload).digest() == self.digest else None


def abandoned(folder: Path) -> list[str]:
    """Tokens of the journals in `folder` whose program is gone, newest first. An unreadable folder has none."""
    try:
        names = [entry.name for entry in folder.iterdir()]
    except OSError:
        return []
    tokens = {name.removesuffix(suffix) for name in names for suffix in SUFFIXES if name.endswith(suffix)}
    return sorted((token for token in tokens if not _in_use(folder, token)), reverse=True)


def recover(folder: Path, token: str) -> Recovered | None:
    """The newest whole state of one journal, of whichever generation; None when there is none. Never raises."""
    return recover_files((folder / (token + suffix) for suffix in SUFFIXES), token)


def recover_newest(folder: Path) -> Recovered | None:
    """Of all abandoned journals the state worked on last that is in no project file. Never raises."""
    found = [state for token in abandoned(folder) if (state := recover(folder, token)) is not None and not state.saved]
    return max(found, key=lambda state: state.time, default=None)


def recover_files(paths: Iterable[Path], token: str = "") -> Recovered | None:
    """As :func:`recover`, of journal files by name."""
    pieces: list[list[_Piece]] = []
    for path in paths:
        try:
            if path.stat().st_size <= LARGEST_JOURNAL:
                pieces.append(list(_scan(path.read_bytes())))
        except (OSError, MemoryError):
            continue
    arrays = _Arrays(piece for file in pieces for piece in file)
    best: Recovered | None = None
    for file in pieces:
        tried = 0
        for piece in reversed(file):
            if piece.kind != COMMIT or piece.length > LARGEST_TREE or (payload := piece.payload()) is None:
                continue
            tried += 1
            if tried > MOST_TRIED:
                break
            try:
                state = _state(payload, arrays, token, 0 if best is None else best.sequence)
            except Exception:  # whatever a damaged file provokes, an older state may do
                continue
            if state is not None:
                best = state
            break
    return best


def check_journal(path: Path) -> list[str]:
    """What is wrong with a journal file, one sentence each; empty when its newest state is whole."""
    try:
        data = path.read_bytes()
    except OSError as error:
        return [f"{path.name} cannot be read: {error.strerror}."]
    pieces = list(_scan(data))
    found = []
    covered = sum(HEADER_SIZE + piece.length for piece in pieces)
    if covered != len(data):
        found.append(f"{path.name} has {len(data) - covered} bytes that are no record (a torn or damaged end).")
    broken = sum(piece.payload() is None for piece in pieces)
    if broken:
        found.append(f"{path.name} has {broken} damaged records.")
    if recover_files([path]) is None:
        found.append(f"{path.name} holds no state that can be recovered.")
    return found


def _in_use(folder: Path, token: str) -> bool:
    try:
        with open(folder / (token + LOCK), "rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # no lock file, or a file system without locks
        return False
    return False


def _scan(data: bytes) -> Iterator[_Piece]:
    """Every record whose header checks; after damage the search goes on at the next magic."""
    at = 0
    while (at := data.find(MAGIC, at)) >= 0:
        header = data[at : at + HEADER.size]
        crc = data[at + HEADER.size : at + HEADER_SIZE]
        if len(crc) == 4 and zlib.crc32(header) == int.from_bytes(crc, "little"):
            _, kind, length, digest = HEADER.unpack(header)
            if at + HEADER_SIZE + length <= len(data):
                yield _Piece(kind, data, at + HEADER_SIZE, length, digest)
                at += HEADER_SIZE + length
                continue
        at += 1


def _state(payload: bytes, arrays: _Arrays, token: str, newer_than: int) -> Recovered | None:
    """The state of a commit; None when it is not newer. Raises when anything about it is not whole."""
    envelope = decode_envelope(payload)
    about = msgspec.convert(envelope.raw.get("journal"), _About)
    if about.sequence < 1:
        raise ValueError("a commit without a number")
    if about.sequence <= newer_than:
        return None
    found = {digest: arrays.get(digest, spec) for digest, spec in envelope.table.items()}
    document = decode_part(envelope, "document", Document, found)
    workspace = decode_part(envelope, "workspace", Workspace, found)
    if problems(document):
        raise ValueError(problems(document)[0])
    return Recovered(
        document, workspace, about.name, about.sequence, about.time, about.project, about.saved, token
    )


class _Arrays:
    """Arrays by hash, put together from objects and deltas of all generations."""

    def __init__(self, pieces: Iterable[_Piece]) -> None:
        self._objects: dict[bytes, list[_Piece]] = {}
        self._deltas: dict[bytes, list[_Piece]] = {}
        for piece in pieces:
            if piece.kind == OBJECT:
                self._objects.setdefault(piece.digest, []).append(piece)
            elif piece.kind == DELTA and piece.length >= DELTA_HEADER.size:
                after = piece.data[piece.start + 32 : piece.start + 64]
                self._deltas.setdefault(after, []).append(piece)
        self._done: dict[str, np.ndarray] = {}
        self._missing: set[str] = set()

    def get(self, digest: str, spec: ArraySpec) -> np.ndarray:
        """The array of that hash; ValueError when it cannot be had."""
        if digest in self._missing:
            raise ValueError("an array is lost")
        if digest not in self._done:
            try:
                payload = self._payload(bytes.fromhex(digest), spec)
                if hashlib.sha256(payload).hexdigest() != digest:
                    raise ValueError("an array does not match its checksum")
                self._done[digest] = array_from(payload, spec)
            except ValueError:
                self._missing.add(digest)
                raise
        return self._done[digest]

    def _payload(self, digest: bytes, spec: ArraySpec) -> bytes:
        chain: list[bytes] = []
        while (whole := self._whole(digest)) is None:
            delta = next((p for piece in self._deltas.get(digest, ()) if (p := piece.payload()) is not None), None)
            if delta is None or len(chain) >= _CHAIN_LIMIT:
                raise ValueError("an array is lost")
            chain.append(delta)
            digest = delta[:32]
        if not chain:
            return whole
        header = spec.header()
        if len(whole) != len(header) + spec.nbytes or not whole.startswith(header) or not spec.shape:
            raise ValueError("an array is not what the table says")
        count = spec.shape[0]
        rows_of_bytes = np.frombuffer(whole, np.uint8, offset=len(header)).reshape(count, -1).copy()
        for delta in reversed(chain):
            _flip(rows_of_bytes, delta)
        return header + rows_of_bytes.tobytes()

    def _whole(self, digest: bytes) -> bytes | None:
        return next((p for piece in self._objects.get(digest, ()) if (p := piece.payload()) is not None), None)


def _flip(rows_of_bytes: Any, delta: bytes) -> None:
    _, _, count, width = DELTA_HEADER.unpack_from(delta)
    if len(delta) != DELTA_HEADER.size + count * (4 + width) or (count and width != rows_of_bytes.shape[1]):
        raise ValueError("a change does not fit its array")
    if not count:
        return
    rows = np.frombuffer(delta, np.int32, count, DELTA_HEADER.size)
    if rows.min() < 0 or rows.max() >= len(rows_of_bytes) or np.any(rows[1:] <= rows[:-1]):
        raise ValueError("a change names rows its array does not have")
    bits = np.frombuffer(delta, np.uint8, offset=DELTA_HEADER.size + 4 * count).reshape(count, width)
    rows_of_bytes[rows] ^= bits
