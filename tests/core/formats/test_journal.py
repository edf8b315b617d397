"""The journal and what can be recovered from it, whatever happened to the file."""

import errno
import os
import threading
import time

import msgspec
import numpy as np
import pytest

from core.document import Document, with_groom
from core.formats.arrays import ArrayHashes
from core.formats.journal import (
    CURRENT,
    DELTA,
    HEADER_SIZE,
    LOCK,
    LONGEST_CHAIN,
    MAGIC,
    PREVIOUS,
    UNFINISHED,
    Journal,
    state_folder,
)
from core.formats.recovery import abandoned, check_journal, recover, recover_files, recover_newest
from core.leaves import same_bits
from core.workspace import Workspace
from tests.core.formats.failing_disk import Disk, failing
from tests.documents import small_document, small_workspace, stroked


def _strokes(journal, count, document=None, workspace=None):
    """Commit that many strokes, waiting for each; returns the states, the initial one first."""
    states = [document or small_document()]
    for i in range(count):
        states.append(stroked(states[-1], i))
        journal.commit(states[-1], workspace or Workspace(), f"Comb {i}")
        journal.flush()
        assert journal.error is None
    return states


@pytest.fixture
def journal(tmp_path):
    journal = Journal(tmp_path / "journals")
    yield journal
    journal.close(remove=False)


def _current(journal):
    return journal.folder / (journal.token + CURRENT)


def test_the_newest_state_comes_back_to_the_bit(journal):
    states = _strokes(journal, 10, workspace=small_workspace())
    state = recover(journal.folder, journal.token)
    assert same_bits(state.document, states[-1])
    assert state.workspace.params == {"radius": 0.25}
    assert (state.name, state.sequence, state.project, state.saved) == ("Comb 9", 10, None, False)
    assert abs(state.time - time.time()) < 60
    assert check_journal(_current(journal)) == []


def test_a_stroke_appends_only_what_changed(journal):
    document = small_document(guides=2000, points=16)
    _strokes(journal, 1, document)
    before = _current(journal).stat().st_size
    groom = document.grooms[0]
    journal.commit(stroked(document, 5, share=0.05), Workspace())
    journal.flush()
    assert _current(journal).stat().st_size - before < 0.5 * groom.guides.points.nbytes
    assert _current(journal).read_bytes().count(MAGIC) > 5


def test_arrays_are_written_whole_again_after_a_while(journal):
    document = small_document(guides=50)
    states = _strokes(journal, LONGEST_CHAIN + 20, document)
    data = _current(journal).read_bytes()
    kinds = []
    at = 0
    while at < len(data):
        kinds.append(data[at + 8])
        at += HEADER_SIZE + int.from_bytes(data[at + 12 : at + 20], "little")
    last_whole = len(kinds) - 1 - kinds[::-1].index(1)
    assert kinds.count(DELTA) > LONGEST_CHAIN
    assert kinds[:last_whole].count(3) >= LONGEST_CHAIN - 1
    assert same_bits(recover(journal.folder, journal.token).document, states[-1])


def test_shapes_may_change_and_arrays_return(journal):
    document = small_document()
    groom = document.grooms[0]
    keep = np.arange(12) % 3 > 0
    guides = groom.guides
    fewer = guides.replace(
        ids=guides.ids[keep], roots=guides.roots.take(keep), points=guides.points[keep], hold=guides.hold[keep],
        selected=guides.selected[keep], frozen=guides.frozen[keep],
    )
    for state in (document, with_groom(document, groom.replace(guides=fewer)), document, Document(), document):
        journal.commit(state, Workspace())
        journal.flush()
        assert same_bits(recover(journal.folder, journal.token).document, state)


def test_a_torn_end_costs_the_newest_state_and_nothing_else(journal):
    document = small_document(guides=3, side=1, points=2)
    ends, states = [], [document]
    for i in range(3):
        states.append(stroked(states[-1], i))
        journal.commit(states[-1], Workspace())
        journal.flush()
        ends.append(_current(journal).stat().st_size)
    data = _current(journal).read_bytes()
    torn = journal.folder / "torn"
    torn.write_bytes(data)
    for length in range(len(data) - 1, -1, -1):
        if length % 7 and min(abs(length - end) for end in [0, *ends]) > 40:
            continue  # between the ends of states every seventh
        os.truncate(torn, length)
        state = recover_files([torn])
        whole = sum(end <= length for end in ends)
        if whole == 0:
            assert state is None
        else:
            assert same_bits(state.document, states[whole])


def test_flipped_bits_never_give_a_wrong_state(journal):
    states = _strokes(journal, 6, small_document(guides=6, side=2))
    data = bytearray(_current(journal).read_bytes())
    damaged = journal.folder / "damaged"
    damaged.write_bytes(data)
    rng = np.random.default_rng(0)
    lost = 0
    for position in rng.integers(0, len(data), 300):
        bit = 1 << int(rng.integers(0, 8))
        data[position] ^= bit
        with open(damaged, "r+b") as file:
            file.seek(position)
            file.write(data[position : position + 1])
        state = recover_files([damaged])
        lost += state is None
        assert state is None or any(same_bits(state.document, known) for known in states[1:])
        data[position] ^= bit
        with open(damaged, "r+b") as file:
            file.seek(position)
            file.write(data[position : position + 1])
    assert lost < 280  # the only whole copy of the mesh may be hit; the generation before is for that


def test_damage_in_the_middle_is_stepped_over(journal):
    states = _strokes(journal, 4)
    data = _current(journal).read_bytes()
    for junk in (b"\x89FILOJ\r\n" * 20, bytes(1000), MAGIC + bytes([1]) + bytes(60)):
        other = journal.folder / "other"
        other.write_bytes(junk + data + junk)
        assert same_bits(recover_files([other]).document, states[-1])
        assert check_journal(other) != []


def test_two_generations_repair_each_other(tmp_path):
    journal = Journal(tmp_path, generation_bytes=0)
    states = _strokes(journal, 30, small_document(guides=40))
    current, previous = (tmp_path / (journal.token + suffix) for suffix in (CURRENT, PREVIOUS))
    assert previous.exists()
    assert current.stat().st_size < 12 * 8000
    assert same_bits(recover(tmp_path, journal.token).document, states[-1])
    current.write_bytes(b"")
    older = recover(tmp_path, journal.token)
    assert any(same_bits(older.document, state) for state in states)
    assert older.sequence > 15
    journal.close(remove=True)
    assert list(tmp_path.iterdir()) == []


def test_a_crash_between_the_two_renames_is_harmless(tmp_path):
    journal = Journal(tmp_path)
    states = _strokes(journal, 3)
    base = tmp_path / journal.token
    os.replace(f"{base}{CURRENT}", f"{base}{UNFINISHED}")
    assert same_bits(recover(tmp_path, journal.token).document, states[-1])
    journal.close(remove=True)


def test_only_journals_of_dead_programs_are_abandoned(tmp_path):
    journal, other = Journal(tmp_path), Journal(tmp_path)
    states = _strokes(journal, 2)
    _strokes(other, 1)
    assert abandoned(tmp_path) == []
    assert recover_newest(tmp_path) is None
    journal.close(remove=False)
    assert abandoned(tmp_path) == [journal.token]
    assert same_bits(recover_newest(tmp_path).document, states[-1])
    other.close(remove=False)
    assert set(abandoned(tmp_path)) == {journal.token, other.token}
    (tmp_path / (other.token + LOCK)).unlink()
    assert set(abandoned(tmp_path)) == {journal.token, other.token}


def test_saved_work_is_not_offered(tmp_path):
    journal = Journal(tmp_path)
    states = _strokes(journal, 2)
    journal.commit(states[-1], Workspace(), "Save", tmp_path / "a.filo", saved=True)
    journal.close(remove=False)
    state = recover(tmp_path, journal.token)
    assert state.saved
    assert state.project == str(tmp_path / "a.filo")
    assert recover_newest(tmp_path) is None


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EIO])
def test_a_failing_disk_stops_neither_work_nor_recovery(tmp_path, monkeypatch, error):
    probe = Journal(tmp_path / "probe", generation_bytes=0)
    with failing(Disk(tmp_path), monkeypatch) as disk:
        _strokes(probe, 8)
    probe.close(remove=True)
    for k in range(1, disk.count + 1):
        folder = tmp_path / f"j{k}"
        journal = Journal(folder, generation_bytes=0)
        state, durable = small_document(), None
        errors = 0
        with failing(Disk(folder, k, error), monkeypatch):
            for i in range(8):
                state = stroked(state, i)
                number = journal.commit(state, Workspace())
                if journal.flush() == number:
                    durable = state
                    assert journal.error is None
                else:
                    errors += 1
                    assert "save your work" in str(journal.error)
                found = recover(folder, journal.token)
                assert (found is None and durable is None) or same_bits(found.document, durable) or errors
                if found is not None and durable is not None:
                    assert found.sequence >= journal.durable
        assert errors <= 1  # the next commit begins a new file and succeeds
        state = stroked(state, 8)
        assert journal.commit(state, Workspace()) == journal.flush()
        assert same_bits(recover(folder, journal.token).document, state)
        journal.close(remove=True)


def test_a_folder_that_cannot_be_written_is_said_and_work_goes_on():
    journal = Journal(folder=state_folder().__class__("/proc/filoplume"))
    journal.commit(small_document(), Workspace())
    assert journal.flush() == 0
    assert "save your work" in str(journal.error)
    journal.close(remove=True)
    assert recover_newest(journal.folder) is None


def test_commits_faster_than_the_disk_wait_for_the_one_before(tmp_path, monkeypatch):
    journal = Journal(tmp_path, patience=5.0)
    gate, real = threading.Event(), os.fsync

    def slow(handle):
        gate.wait(5)
        real(handle)

    monkeypatch.setattr(os, "fsync", slow)
    first = journal.commit(small_document(), Workspace())
    second = threading.Thread(target=journal.commit, args=(stroked(small_document(), 1), Workspace()))
    second.start()
    time.sleep(0.1)
    assert second.is_alive()  # so at most one state is ever unwritten
    assert journal.durable == 0
    gate.set()
    second.join()
    assert journal.durable >= first
    journal.close(remove=True)


def test_the_folder_can_be_set(monkeypatch, tmp_path):
    monkeypatch.setenv("FILOPLUME_STATE", str(tmp_path / "here"))
    assert state_folder() == tmp_path / "here"
    monkeypatch.delenv("FILOPLUME_STATE")
    assert "filoplume" in str(state_folder())


def test_recovery_never_raises(tmp_path):
    for name, data in (
        ("a" + CURRENT, b""), ("b" + CURRENT, MAGIC * 100), ("c" + CURRENT, os.urandom(5000)), ("d" + PREVIOUS, b"x"),
    ):  # fmt: skip
        (tmp_path / name).write_bytes(data)
    (tmp_path / ("e" + CURRENT)).mkdir()
    (tmp_path / ("f" + CURRENT)).symlink_to("/nonexistent")
    assert len(abandoned(tmp_path)) == 6
    assert recover_newest(tmp_path) is None
    assert recover_newest(tmp_path / "none") is None
    assert recover_newest(tmp_path / ("a" + CURRENT)) is None


def test_hashes_are_shared_with_the_project(tmp_path):
    hashes = ArrayHashes()
    journal = Journal(tmp_path, hashes)
    document = small_document()
    journal.commit(document, Workspace())
    journal.flush()
    points = document.grooms[0].guides.points
    assert hashes.of(points) in _current(journal).read_bytes().decode("latin1")
    assert msgspec.json.encode(hashes.of(points))
    journal.close(remove=True)


def test_every_commit_is_synced_and_a_new_generation_before_it_gets_its_name(tmp_path, monkeypatch):
    journal = Journal(tmp_path, generation_bytes=0)
    with failing(Disk(tmp_path), monkeypatch) as disk:
        states = _strokes(journal, 3, small_document(guides=500))
        first = disk.calls.index("replace")
        assert "fsync" in disk.calls[disk.calls.index("write") : first]
        assert disk.calls[first + 1] == "fsync"
        del disk.calls[:]
        journal.commit(stroked(states[-1], 9), Workspace())
        journal.flush()
        assert disk.calls.count("fsync") == 1  # one for a commit
        assert disk.calls[-1] == "fsync"
    journal.close(remove=True)
