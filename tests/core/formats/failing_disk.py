"""A disk on which the k-th operation fails: real files, real calls, one of them refused."""

from __future__ import annotations

import builtins
import errno
import io
import os
from contextlib import contextmanager


class Disk:
    """Counts the operations on files under `folder` and refuses number `fail_at` (from 1; 0 refuses none).

    With `for_good` every later one is refused as well, as a full or vanished disk does.
    """

    def __init__(self, folder, fail_at=0, error=errno.ENOSPC, for_good=False):
        self.folder, self.fail_at, self.error, self.for_good = os.path.realpath(folder), fail_at, error, for_good
        self.count = 0
        self.calls = []

    def step(self, what, path):
        if not os.path.realpath(os.fspath(path)).startswith(self.folder):
            return
        self.count += 1
        self.calls.append(what)
        if self.fail_at and (self.count == self.fail_at or (self.for_good and self.count > self.fail_at)):
            raise OSError(self.error, os.strerror(self.error), os.fspath(path))


class _File(io.FileIO):
    disk = None

    def write(self, data):
        try:
            self.disk.step("write", self.name)
        except OSError:
            super().write(memoryview(data).cast("B")[: len(data) // 2])  # what a full disk does: half of it arrives
            raise
        return super().write(data)

    def readinto(self, buffer):
        self.disk.step("read", self.name)
        return super().readinto(buffer)


@contextmanager
def failing(disk, monkeypatch):
    """Within it, files under the folder of `disk` are opened, written, synced, renamed and linked through it."""
    real_open, paths = builtins.open, {}

    def open_file(file, mode="r", buffering=-1, *args, **kwargs):
        if isinstance(file, int) or "b" not in mode:
            return real_open(file, mode, buffering, *args, **kwargs)
        disk.step("open", file)
        raw = _File(file, mode.replace("b", ""))
        raw.disk = disk
        paths[raw.fileno()] = os.fspath(file)
        return io.BufferedWriter(raw) if mode[0] in "wax" else io.BufferedReader(raw)

    def wrap(name, place):
        real = getattr(os, name)

        def call(*args, **kwargs):
            path = paths.get(args[place], "/") if isinstance(args[place], int) else args[place]
            if name != "open" or args[1] & (os.O_CREAT | os.O_RDWR):
                disk.step(name, path)
            result = real(*args, **kwargs)
            if name == "open":
                paths[result] = os.fspath(args[0])
            return result

        return call

    with monkeypatch.context() as patch:
        for name, place in (("open", 0), ("fsync", 0), ("replace", 1), ("link", 1)):
            patch.setattr(os, name, wrap(name, place))
        patch.setattr(builtins, "open", open_file)
        yield disk
