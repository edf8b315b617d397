"""Programs that are killed: started once, they fork a child for every kill, so that a kill costs milliseconds.

Standard input: one line "save FOLDER SEED", "journal FOLDER SEED" or "recover FOLDER SEED" per child. Standard output:
"pid N", then from the child one line per state safely written, "ack N"; "end N" when it is gone.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from core.document import Document
from core.formats.journal import Journal
from core.formats.project import write_project
from core.formats.recovery import recover_newest
from core.workspace import Workspace
from tests.documents import small_document, stroked
from tools.session import Session

GUIDES, SIDE, POINTS = 8, 2, 4


def state(seed: int, number: int) -> Document:
    """State `number` of a run: the same in the child and in the test."""
    document = small_document(GUIDES, SIDE, POINTS, seed)
    return document if number == 0 else stroked(document.replace(last_frame=1100 + number), seed * 100_003 + number)


def number_of(document: Document) -> int:
    """Which state of its run a document is."""
    return document.last_frame - 1100


def _say(line: str) -> None:
    os.write(1, (line + "\n").encode())


def save_for_ever(folder: Path, seed: int) -> None:
    """Save state after state over one file."""
    for number in range(1, 100_000):
        write_project(folder / "a.filo", state(seed, number))
        _say(f"ack {number}")


def journal_for_ever(folder: Path, seed: int) -> None:
    """Commit state after state, paced like a very quick hand; small generations, so that kills meet compaction too."""
    journal = Journal(folder, generation_bytes=0, patience=10.0)
    for number in range(1, 100_000):
        journal.commit(state(seed, number), Workspace())
        if journal.durable:
            _say(f"ack {journal.durable}")
        _say(f"sent {number}")
        time.sleep(0.002)


def recover_and_go_on(folder: Path, seed: int) -> None:
    """Recover what an earlier child left and say which state it was; then commit on."""
    session = Session.recover(folder)
    if session is None:
        _say("recovered 0")
        return
    found = number_of(session.document)
    _say(f"recovered {found}")
    for number in range(found + 1, 100_000):
        session.commit("Comb", state(seed, number))


def main() -> None:
    """Serve kills until standard input ends."""
    calls = {"save": save_for_ever, "journal": journal_for_ever, "recover": recover_and_go_on}
    recover_newest(Path("/nonexistent"))
    state(0, 1)
    for line in sys.stdin:
        what, folder, seed = line.split()
        child = os.fork()
        if child == 0:
            try:
                calls[what](Path(folder), int(seed))
            finally:
                os._exit(0)
        _say(f"pid {child}")
        os.waitpid(child, 0)
        _say(f"end {child}")


if __name__ == "__main__":
    main()
