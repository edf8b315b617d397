"""Replacing a whole file so that at every moment the old one or the new one is there, complete."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import socket
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from core.errors import UserError

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_FORBIDDEN = {errno.EACCES, errno.EPERM, errno.EROFS}


@contextmanager
def atomic_write(path: str | os.PathLike[str], keep_previous: bool = False) -> Iterator[Path]:
    """Write a file as a whole: the body fills the temporary path it is given, which then takes the place of `path`.

    The temporary file lies beside `path`, exists, is empty and has the same suffix. When the body ends it is fsynced
    and renamed over `path`, and the folder is fsynced. When the body (or any of this) fails, Ctrl-C included, the
    temporary file is removed and `path` is as it was.

    Parameters
    ----------
    path : the file to make or replace; a symbolic link is followed.
    keep_previous : keep the file replaced under the same name with a "1" at the end.

    Raises
    ------
    UserError
        The file system refused (OSError); says why and what to do. Any other exception of the body passes through.
    """
    target = Path(os.path.realpath(path))
    temp: Path | None = None
    replaced = False
    try:
        if target.exists() and not target.is_file():
            raise UserError(f"{target} is not an ordinary file: choose another name to save under.")
        _remove_stale(target)
        temp = _reserve(target)
        yield temp
        _sync(temp)
        if target.exists():
            shutil.copymode(target, temp)
            if keep_previous:
                _keep(target)
        os.replace(temp, target)
        replaced = True
        sync_folder(target.parent)
    except BaseException as error:
        if temp is not None and not replaced:
            with suppress(OSError):
                temp.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise UserError(_sentence(target, error, replaced)) from error
        raise


def _reserve(target: Path) -> Path:
    temp = target.with_name(f"{_temp_prefix(target)}{os.getpid()}-{secrets.token_hex(4)}.part{target.suffix}")
    os.close(os.open(temp, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666))
    return temp


def _temp_prefix(target: Path) -> str:
    # the machine is in the name because a folder may be shared, and process ids mean nothing elsewhere
    return f".{target.stem[:40]}-{zlib.crc32(socket.gethostname().encode()):08x}-"


def _remove_stale(target: Path) -> None:
    """Remove temporary files that killed processes of this machine left for `target`."""
    prefix, suffix = _temp_prefix(target), f".part{target.suffix}"
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if entry.name.startswith(prefix) and entry.name.endswith(suffix):
                pid = entry.name[len(prefix) :].split("-")[0]
                if pid.isdigit() and not _alive(int(pid)):
                    os.unlink(entry.path)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def _keep(target: Path) -> None:
    """Keep the present file under its second name, itself replaced in one step."""
    beside = _reserve(target)
    try:
        beside.unlink()
        try:
            os.link(target, beside)
        except OSError:  # no hard links on this file system
            shutil.copyfile(target, beside)
            _sync(beside)
        os.replace(beside, target.with_name(target.name + "1"))
    finally:
        with suppress(OSError):  # a rename between two names of one file leaves both
            beside.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder safe on disk, where its file system can do that."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems cannot, and need not
            raise
    finally:
        os.close(handle)


def _sentence(target: Path, error: OSError, replaced: bool) -> str:
    why = error.strerror or str(error)
    if replaced:
        return f"{target} was written, but the disk did not confirm it ({why}): save once more, to another disk."
    if error.errno in _FULL:
        advice = "there is no room for it: free some space or save to another disk"
    elif error.errno in _FORBIDDEN:
        advice = "this place may not be written to: save to another folder"
    elif error.errno == errno.ENOENT and not target.parent.is_dir():
        advice = f"the folder {target.parent} does not exist: create it or save to another folder"
    else:
        advice = f"the disk answered '{why}': save to another folder"
    return f"{target} could not be saved, {advice}." + (" The earlier file is as it was." if target.exists() else "")
