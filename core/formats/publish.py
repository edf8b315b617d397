"""Publishing: immutable, numbered versions in a folder, and one name, ``latest``, that is switched in one step.

A version is built beside the others under a hidden name and renamed to the first free number when it is whole: a
rename onto a version that is there fails, so two who publish at once get two numbers. (*A reliable versioning and
publishing system*, SIGGRAPH 2001.)
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import secrets
import shutil
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from core.errors import UserError
from core.formats.atomic import sync_folder

MANIFEST = "version.json"
LATEST = "latest"
_VERSION = re.compile(r"v(\d{3,})")


def publish(folder: Path, fill: Callable[[Path], None], about: dict[str, Any]) -> Path:
    """Make the next version in `folder`; its path.

    Parameters
    ----------
    fill : writes the files of the version into the empty folder it is given.
    about : what the manifest says beside the version, the files and their SHA-256.

    Raises
    ------
    UserError
        The folder cannot be written to. Nothing half-made is left; `latest` is as it was.
    """
    made: Path | None = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        made = folder / f".publishing-{os.getpid()}-{secrets.token_hex(6)}"
        made.mkdir()
        fill(made)
        files = {
            str(path.relative_to(made)): {"sha256": digest(path), "bytes": path.stat().st_size}
            for path in sorted(made.rglob("*")) if path.is_file()
        }
        version = _placed(folder, made, {**about, "files": files})
        made = None
        _switch(folder)
        return version
    except OSError as error:
        why = error.strerror or str(error)
        raise UserError(f"Nothing was published to {folder} ({why}); choose a folder you may write to.") from error
    finally:
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)


def versions(folder: Path) -> list[int]:
    """The numbers of the versions in a folder, ascending."""
    if not folder.is_dir():
        return []
    found = (_VERSION.fullmatch(path.name) for path in folder.iterdir() if path.is_dir() and not path.is_symlink())
    return sorted(int(match[1]) for match in found if match)


def digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _placed(folder: Path, made: Path, manifest: dict[str, Any]) -> Path:
    """Rename the finished folder to the first free number, everything in it read-only."""
    number = max(versions(folder), default=0) + 1
    while True:
        target = folder / f"v{number:03d}"
        (made / MANIFEST).write_text(json.dumps({"version": number, **manifest}, indent=2), encoding="utf-8")
        try:
            os.rename(made, target)
            break
        except OSError as error:
            if error.errno not in (errno.EEXIST, errno.ENOTEMPTY):
                raise
            number += 1  # somebody was quicker
    for path in [*target.rglob("*"), target]:
        with suppress(OSError):  # some file systems know no permissions; the version is whole all the same
            mode = path.stat().st_mode
            path.chmod(mode & ~(stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH))
    sync_folder(folder)
    return target


def _switch(folder: Path) -> None:
    """Let `latest` name the highest version there is."""
    while True:
        highest = versions(folder)[-1]
        beside = folder / f".latest-{os.getpid()}-{secrets.token_hex(6)}"
        os.symlink(f"v{highest:03d}", beside)
        os.replace(beside, folder / LATEST)
        if versions(folder)[-1] == highest:  # else another came in between, which may have switched before us
            return
