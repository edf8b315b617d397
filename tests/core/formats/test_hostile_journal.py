"""Journals made to hurt: none stops a start, and what is sound in them is still found."""

import hashlib
import struct
import time
import zlib

import msgspec
import numpy as np
import pytest

from core.formats.journal import COMMIT, DELTA, DELTA_HEADER, OBJECT, record
from core.formats.recovery import check_journal, recover_files
from core.leaves import same_bits
from tests.core.formats.hostile_parts import DOCUMENT, ENCODED, POINTS, TREE, npy


def commit(tree=None, arrays=None, **about):
    """A journal commit record."""
    about = {"sequence": 1, "name": "x", "time": 0.0, "project": None, "saved": False} | about
    raw = {**(TREE if tree is None else tree), "journal": about} | ({} if arrays is None else {"arrays": arrays})
    return b"".join(record(COMMIT, [msgspec.json.encode(raw)]))


def objects(skip=()):
    return b"".join(b"".join(record(OBJECT, [npy(a)])) for d, a in ENCODED.arrays.items() if d not in skip)


def delta(before, after, rows, bits, count=None, width=None):
    rows, bits = np.asarray(rows, np.int32), np.asarray(bits, np.uint8)
    head = DELTA_HEADER.pack(
        bytes.fromhex(before), bytes.fromhex(after), len(rows) if count is None else count,
        bits.shape[-1] if width is None else width,
    )
    return b"".join(record(DELTA, [head, rows.tobytes(), bits.tobytes()]))


def header(kind, length, digest=bytes(32)):
    raw = struct.pack("<8sB3xQ32s", b"\x89FILOJ\r\n", kind, length, digest)
    return raw + zlib.crc32(raw).to_bytes(4, "little")


FACES = TREE["document"]["grooms"][0]["guides"]["roots"]["faces"]
points = DOCUMENT.grooms[0].guides.points
MOVED = hashlib.sha256(npy(points + 1)).hexdigest()
LOST = objects(skip={POINTS})  # without the points
BASE = LOST + b"".join(record(OBJECT, [npy(points + 1)]))
ZERO, ONES = [0] * 48, [1] * 48
HOSTILE = {
    "a commit without arrays": commit(),
    "a record of 2^63 bytes": header(OBJECT, 2**63) + objects()[:200],
    "a record of unknown type": b"".join(record(77, [b"x"])) + commit(),
    "a hundred thousand headers": header(COMMIT, 0) * 100_000,
    "deltas in a circle": LOST + delta(POINTS, MOVED, [0], [ZERO]) + delta(MOVED, POINTS, [0], [ZERO]) + commit(),
    "a delta on itself": LOST + delta(POINTS, POINTS, [0], [ZERO]) + commit(),
    "a delta on nothing": LOST + delta("0" * 64, POINTS, [0], [ZERO]) + commit(),
    "rows beyond the array": BASE + delta(MOVED, POINTS, [10**6], [ONES]) + commit(),
    "negative rows": BASE + delta(MOVED, POINTS, [-1], [ONES]) + commit(),
    "a row twice": BASE + delta(MOVED, POINTS, [1, 1], [ONES] * 2) + commit(),
    "2^32-1 rows": BASE + delta(MOVED, POINTS, [1], [ONES], count=2**32 - 1) + commit(),
    "rows of another width": BASE + delta(MOVED, POINTS, [1], [[1] * 12]) + commit(),
    "a delta too short for its header": LOST + b"".join(record(DELTA, [b"xx"])) + commit(),
    "deep JSON": objects() + b"".join(record(COMMIT, [b"[" * 100_000 + b"]" * 100_000])),
    "a commit of 20 MB": objects() + b"".join(record(COMMIT, [b" " * (20 << 20)])),
    "a negative sequence": objects() + commit(sequence=-5),
    "text for a time": objects() + commit(time="now"),
    "a newer format": objects() + commit({**TREE, "format": 99}),
    "a table of objects": objects() + commit(arrays={POINTS: {"dtype": "|O", "shape": [1]}}),
    "a table of giants": objects() + commit(arrays={POINTS: {"dtype": "<f4", "shape": [2**40]}}),
    "hashes that are none": objects() + commit(arrays={"zz": {"dtype": "<f4", "shape": [1]}}),
    "roots off the mesh": objects() + b"".join(record(OBJECT, [npy(np.full(12, 99, np.int32))])) + commit(
        msgspec.json.decode(
            ENCODED.json.replace(FACES.encode(), hashlib.sha256(npy(np.full(12, 99, np.int32))).hexdigest().encode())
        )
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_journal_gives_nothing_and_never_raises(name, tmp_path):
    path = tmp_path / "evil.journal"
    path.write_bytes(HOSTILE[name])
    start = time.process_time()  # of the processor: a busy machine is no fault
    assert recover_files([path]) is None
    assert check_journal(path) != []
    assert time.process_time() - start < 10.0


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_sound_before_the_hostile_part_is_still_found(name, tmp_path):
    path = tmp_path / "evil.journal"
    path.write_bytes(objects() + commit(sequence=5) + HOSTILE[name])
    state = recover_files([path])
    assert same_bits(state.document, DOCUMENT)


def test_the_honest_journal_made_the_same_way_is_recovered(tmp_path):
    path = tmp_path / "good.journal"
    path.write_bytes(objects() + commit())
    assert same_bits(recover_files([path]).document, DOCUMENT)
