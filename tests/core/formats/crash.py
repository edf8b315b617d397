"""Killing programs at random moments, and what must hold afterwards."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from core.formats.project import check_project, read_project
from core.formats.recovery import recover_newest
from core.leaves import same_bits

sys.path.insert(0, os.path.dirname(__file__))
from tests.core.formats.crash_child import number_of, state

CHILD = Path(__file__).with_name("crash_child.py")


class Crasher:
    """Starts the children and kills them."""

    def __init__(self, folder, seed=0):
        self.folder = Path(folder)
        self.random = random.Random(seed)
        self.zygote = subprocess.Popen(
            [sys.executable, str(CHILD)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
        )

    def close(self):
        self.zygote.stdin.close()
        self.zygote.wait()
        self.zygote.stdout.close()

    def kill(self, what, folder, seed, seconds):
        """Let a child do `what` for so long, kill -9 it, and return the lines it said."""
        self.zygote.stdin.write(f"{what} {folder} {seed}\n")
        self.zygote.stdin.flush()
        lines, pid = [], None
        while pid is None:
            line = self.zygote.stdout.readline().split()
            if line[0] == "pid":
                pid = int(line[1])
            else:
                lines.append(line)
        time.sleep(seconds)
        os.kill(pid, signal.SIGKILL)  # a child that ended by itself is a zombie until waited for
        while (line := self.zygote.stdout.readline().split()) != ["end", str(pid)]:
            lines.append(line)
        return lines


def _newest(lines, word):
    return max((int(line[1]) for line in lines if len(line) == 2 and line[0] == word), default=0)


def kill_saves(crasher, times):
    """Kill saves; after each the file holds a whole document, at least as new as the last acknowledged."""
    folder = crasher.folder / "saves"
    folder.mkdir()
    partial = 0
    for seed in range(times):
        lines = crasher.kill("save", folder, seed, crasher.random.uniform(0.0, 0.06))
        path = folder / "a.filo"
        partial += any(".part" in name for name in os.listdir(folder))
        if path.exists():
            assert check_project(path) == []
            document = read_project(path).document
            acknowledged = _newest(lines, "ack")
            assert number_of(document) >= acknowledged or acknowledged == 0
            known = [s for s in (seed, seed - 1) if s >= 0 and same_bits(document, state(s, number_of(document)))]
            if not known:  # several children may have died before their first save
                known = [s for s in range(seed) if same_bits(document, state(s, number_of(document)))]
            assert known
            if acknowledged:
                assert known[0] == seed
        else:
            assert _newest(lines, "ack") == 0
        if seed % 10 == 9:
            shutil.rmtree(folder)
            folder.mkdir()
    return partial


def kill_journals(crasher, times):
    """Kill autosaves; recovery gives a state of the run, at most the newest stroke short."""
    torn = 0
    for seed in range(times):
        folder = crasher.folder / f"journal{seed}"
        lines = crasher.kill("journal", folder, seed, crasher.random.uniform(0.005, 0.15))
        acknowledged, sent = _newest(lines, "ack"), _newest(lines, "sent")
        found = _recovered(folder, seed)
        assert found >= acknowledged
        assert found >= sent - 1  # `sent` is said after the hand-over of that stroke
        torn += 0 < found < sent
        if found and seed % 3 == 0:  # killed once more while recovering and going on
            lines = crasher.kill("recover", folder, seed, crasher.random.uniform(0.0, 0.08))
            again = _recovered(folder, seed)
            assert again >= found
            assert _newest(lines, "recovered") in (0, found)
        shutil.rmtree(folder, ignore_errors=True)
    return torn


def _recovered(folder, seed):
    found = recover_newest(folder)
    if found is None:
        return 0
    number = number_of(found.document)
    assert same_bits(found.document, state(seed, number))
    return number
