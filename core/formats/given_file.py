"""Files an artist gives: may one be read at all, and JSON of a known form, refused in one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

import msgspec

from core.errors import UserError

_T = TypeVar("_T")

LARGEST_JSON = 1 << 28  # bytes


def must_be_readable(path: Path, what: str, largest: int) -> None:
    """Refuse what is not there, no file, empty, closed to us or larger than `largest` bytes. what : "mesh", "rig"."""
    try:
        if not path.is_file():
            raise UserError(f"{path.name} is {'a folder' if path.is_dir() else 'not there'}; give the name of a file.")
        size = path.stat().st_size
        with path.open("rb") as file:
            file.read(1)
    except (OSError, ValueError) as error:
        raise UserError(f"{path.name[:80]} cannot be opened ({getattr(error, 'strerror', None) or error}).") from None
    if not size:
        raise UserError(f"{path.name} is empty; export it again.")
    if size > largest:
        raise UserError(f"{path.name} is larger than {largest >> 30} GB; export a smaller {what}.")


def decoded_json(path: Path, kind: type[_T], what: str, largest: int = LARGEST_JSON) -> _T:
    """The records in a JSON file. what : what such a file holds, as in "a file of tracks".

    Raises
    ------
    UserError
        The file cannot be opened, is larger than `largest` bytes or not of this form; the message says where.
    """
    try:
        if path.stat().st_size > largest:
            raise UserError(f"{path.name} is too large for {what}.")
        data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")  # editors of Windows begin a file so
        return msgspec.json.decode(data, type=kind)
    except (OSError, ValueError) as error:
        if isinstance(error, (msgspec.DecodeError, UnicodeDecodeError)):
            raise UserError(f"{path.name} is not {what}: {str(error).rstrip('.')}.") from None
        raise UserError(f"{path.name[:80]} cannot be opened ({getattr(error, 'strerror', None) or error}).") from None
    except RecursionError:
        raise UserError(f"{path.name} is not {what}: it is nested too deeply.") from None
