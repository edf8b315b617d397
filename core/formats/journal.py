"""The journal: after every commit the state goes to the end of a file, so that a crash costs one stroke at most.

A file is a row of records: magic, type, length, SHA-256 of the payload, CRC of the header, payload. Types: OBJECT is
the .npy bytes of an array, DELTA the rows that changed since another array (old XOR new), COMMIT the JSON of a tree
that names its arrays by hash. One fsync seals a commit. When the file has grown long, a new generation is begun beside
it and the one before is kept, because a flipped bit in the only whole copy of an array could not be repaired.

Reading is in ``recovery.py``.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import secrets
import struct
import threading
import time
import zlib
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import platformdirs

from core.document import Document
from core.errors import UserError
from core.formats.arrays import ArrayHashes, raw_bytes, spec_of
from core.formats.atomic import sync_folder
from core.formats.tree import encode_tree
from core.leaves import Path as LeafPath
from core.leaves import leaves
from core.rows import RowChange, row_change
from core.workspace import Workspace

MAGIC = b"\x89FILOJ\r\n"
HEADER = struct.Struct("<8sB3xQ32s")  # magic, type, length, sha256; then the CRC of these, 4 bytes
HEADER_SIZE = HEADER.size + 4
DELTA_HEADER = struct.Struct("<32s32sII")  # hash before, hash after, count of rows, bytes of a row
OBJECT, DELTA, COMMIT = 1, 2, 3
LONGEST_CHAIN = 64  # the array is written whole after so many deltas

CURRENT, PREVIOUS, UNFINISHED, LOCK = ".journal", ".journal1", ".journal.part", ".lock"
SUFFIXES = (CURRENT, PREVIOUS, UNFINISHED)


def state_folder() -> Path:
    """Where the journals of this person lie: FILOPLUME_STATE, else the state folder of the platform."""
    set_by_hand = os.environ.get("FILOPLUME_STATE")
    return Path(set_by_hand) if set_by_hand else platformdirs.user_state_path("filoplume") / "journals"


class _Wanted(NamedTuple):
    sequence: int
    name: str
    document: Document
    workspace: Workspace
    project: str | None
    saved: bool


class Journal:
    """The journal of one open document, saved or not, written by a thread of its own.

    Commits that come faster than they can be written are joined, the newest counts; but a commit waits (up to
    `patience` seconds) until the one before it is safe, so a crash loses at most the newest.

    error : why the last attempt failed, or None. Work goes on without a journal; the next commit tries again.
    written : when a state was last safe on disk, in seconds of ``time.monotonic``, or None.
    """

    def __init__(
        self, folder: Path | None = None, hashes: ArrayHashes | None = None, generation_bytes: int = 64 << 20,
        patience: float = 0.25,
    ) -> None:
        self.error: UserError | None = None
        self.written: float | None = None
        self.folder = folder or state_folder()
        self.token = f"{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}-{secrets.token_hex(4)}"
        self._hashes = hashes or ArrayHashes()
        self._generation_bytes = generation_bytes
        self._patience = patience
        self._writer = ThreadPoolExecutor(1, thread_name_prefix="journal")
        self._mutex = threading.Lock()
        self._wanted: _Wanted | None = None
        self._jobs: list[Future[None]] = []
        self._sequence = 0
        self._durable = 0
        # what follows belongs to the writer thread
        self._file: IO[bytes] | None = None
        self._lock_file: IO[bytes] | None = None
        self._start_bytes = 0
        self._chains: dict[str, int] = {}  # hash of every array in the file -> deltas it stands on
        self._last: dict[LeafPath, np.ndarray] = {}

    def commit(
        self, document: Document, workspace: Workspace, name: str = "", project: Path | None = None, saved: bool = False
    ) -> int:
        """Hand over a state to be written; returns its number. Never raises for the disk's sake (see `error`).

        Parameters
        ----------
        name : of the step.
        project : the project file the document belongs to, if any.
        saved : True when this very state is in that file: then there is nothing to recover.
        """
        with self._mutex:
            earlier = list(self._jobs)
        if earlier:
            wait(earlier, self._patience)
        with self._mutex:
            self._sequence += 1
            where = None if project is None else os.fspath(project.absolute())
            self._wanted = _Wanted(self._sequence, name, document, workspace, where, saved)
            self._jobs = [job for job in self._jobs if not job.done()]
            with suppress(RuntimeError):  # closed
                self._jobs.append(self._writer.submit(self._drain))
            return self._sequence

    def flush(self, timeout: float | None = None) -> int:
        """Wait for what was handed over and return the number of the newest state safely on disk."""
        with self._mutex:
            jobs = list(self._jobs)
        wait(jobs, timeout)
        return self._durable

    @property
    def durable(self) -> int:
        """Number of the newest state safely on disk."""
        return self._durable

    def close(self, remove: bool) -> None:
        """Write what is outstanding and end; `remove` the journal when nothing in it is needed any more."""
        self._writer.shutdown(wait=True)
        if self._file is not None:
            self._file.close()
            self._file = None
        if remove:
            remove_journal(self.folder, self.token)
        if self._lock_file is not None:
            self._lock_file.close()
            self._lock_file = None

    def _drain(self) -> None:
        with self._mutex:
            wanted, self._wanted = self._wanted, None
        if wanted is None:  # joined with an earlier one
            return
        try:
            self._write(wanted)
        except Exception as error:  # a failing autosave must never take the work with it
            self._abandon_file()
            why = error.strerror if isinstance(error, OSError) else str(error)
            self.error = UserError(
                f"The autosave in {self.folder} failed ({why}): save your work now, elsewhere if this disk is full."
            )
        else:
            self._durable, self.error, self.written = wanted.sequence, None, time.monotonic()

    def _write(self, wanted: _Wanted) -> None:
        too_long = self._file is not None and self._file.tell() > max(self._generation_bytes, 4 * self._start_bytes)
        if self._file is None or too_long:
            self._begin_generation(wanted)
        else:
            records, last, chains = self._records(wanted, self._last, self._chains)
            _append(self._file, records)
            self._last, self._chains = last, chains

    def _begin_generation(self, wanted: _Wanted) -> None:
        """A new file with everything in it; the old one is kept. At no moment is there none that can be read."""
        self.folder.mkdir(parents=True, exist_ok=True)
        if self._lock_file is None:
            lock = open(self.folder / (self.token + LOCK), "wb")  # noqa: SIM115 (held while the journal lives)
            with suppress(OSError):  # a file system without locks
                fcntl.flock(lock, fcntl.LOCK_EX)  # waits only for one that looks whether we live
            self._lock_file = lock
        records, last, chains = self._records(wanted, {}, {})
        base = self.folder / self.token
        unfinished, current = Path(f"{base}{UNFINISHED}"), Path(f"{base}{CURRENT}")
        file = open(unfinished, "wb")  # noqa: SIM115 (stays open)
        try:
            _append(file, records)
            if current.exists():
                os.replace(current, f"{base}{PREVIOUS}")
            os.replace(unfinished, current)
            sync_folder(self.folder)
        except BaseException:
            with suppress(OSError):
                file.close()
            unfinished.unlink(missing_ok=True)
            raise
        self._abandon_file()
        self._file, self._start_bytes = file, file.tell()
        self._last, self._chains = last, chains

    def _abandon_file(self) -> None:
        """After a failed write or fsync nobody knows what the file holds: the next commit begins a new one."""
        if self._file is not None:
            with suppress(OSError):
                self._file.close()
        self._file, self._last, self._chains = None, {}, {}

    def _records(
        self, wanted: _Wanted, last: dict[LeafPath, np.ndarray], chains: dict[str, int]
    ) -> tuple[list[Any], dict[LeafPath, np.ndarray], dict[str, int]]:
        """The buffers to append for a state, and what is then last and stored."""
        out: list[Any] = []
        chains = dict(chains)
        now = {("document", *path): array for path, array in leaves(wanted.document)}
        now |= {("workspace", *path): array for path, array in leaves(wanted.workspace)}
        for path, array in now.items():
            digest = self._hashes.of(array)
            if digest in chains:
                continue
            before = last.get(path)
            links, change = LONGEST_CHAIN, None
            if before is not None and before.shape == array.shape and before.dtype == array.dtype and array.ndim:
                links = chains[self._hashes.of(before)] + 1
                change = row_change(before, array) if links < LONGEST_CHAIN else None
            if before is not None and change is not None and 2 * change.nbytes < array.nbytes:
                out += _delta(self._hashes.of(before), digest, change)
                chains[digest] = links
            else:
                out += record(OBJECT, [spec_of(array).header(), raw_bytes(array).data], bytes.fromhex(digest))
                chains[digest] = 0
        about = {
            "sequence": wanted.sequence, "name": wanted.name, "time": time.time(), "project": wanted.project,
            "saved": wanted.saved,
        }  # fmt: skip
        tree = encode_tree(wanted.document, wanted.workspace, self._hashes, journal=about)
        out += record(COMMIT, [tree.json])
        return out, now, chains


def record(kind: int, payload: list[Any], digest: bytes | None = None) -> list[Any]:
    """Header and payload of one record; `digest` spares the hashing where the SHA-256 is known."""
    if digest is None:
        hasher = hashlib.sha256()
        for part in payload:
            hasher.update(part)
        digest = hasher.digest()
    header = HEADER.pack(MAGIC, kind, sum(len(part) for part in payload), digest)
    return [header + zlib.crc32(header).to_bytes(4, "little"), *payload]


def _delta(before: str, after: str, change: RowChange) -> list[Any]:
    width = change.bits.shape[1] if len(change.rows) else 0
    head = DELTA_HEADER.pack(bytes.fromhex(before), bytes.fromhex(after), len(change.rows), width)
    return record(DELTA, [head, raw_bytes(change.rows).data, raw_bytes(change.bits).data])


def _append(file: IO[bytes], buffers: Iterable[Any]) -> None:
    for buffer in buffers:
        file.write(buffer)
    file.flush()
    os.fsync(file.fileno())


def remove_journal(folder: Path, token: str) -> None:
    """Remove every file of a journal (those that cannot be removed stay)."""
    for suffix in (*SUFFIXES, LOCK):
        with suppress(OSError):
            (folder / (token + suffix)).unlink(missing_ok=True)
