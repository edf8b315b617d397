"""Masks of a plate as JSON: ``{"masks": [{"name": ..., "smooth": false, "inverted": false, "keys": [[frame, [[x, y],
...]], ...]}]}``; frames and pixels as those of tracks. Every key has the same number of points."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from core.errors import UserError
from core.formats.given_file import decoded_json
from core.match.outline import Mask


class _Mask(msgspec.Struct):
    keys: list[tuple[int, list[tuple[float, float]]]]
    name: str = "mask"
    smooth: bool = False
    inverted: bool = False


class _File(msgspec.Struct):
    masks: list[_Mask]


def read_masks(path: Path) -> tuple[Mask, ...]:
    """Read masks, to hold tracks off.

    Raises
    ------
    UserError
        The file is not of this form; the message says what is wrong.
    """
    file = decoded_json(path, _File, "a file of masks")
    made = []
    for number, one in enumerate(file.masks, 1):
        keys = sorted(one.keys, key=lambda key: key[0])
        name = "".join(c for c in one.name if c.isprintable())[:255] or f"mask{number}"
        if not keys or len({len(points) for _, points in keys}) != 1:
            raise UserError(f"{path.name}: mask {name!r} needs a key, and as many points at every key.")
        try:
            frames = np.array([frame for frame, _ in keys], np.int32)
            points = np.array([points for _, points in keys], np.float64).reshape(len(keys), -1, 2)
            mask = Mask(
                id=number, name=name, frames=frames, points=points, smooth=one.smooth, inverted=one.inverted
            )
        except (ValueError, OverflowError) as error:
            raise UserError(f"{path.name}: mask {name!r} cannot be used: {error}.") from None
        made.append(mask)
    return tuple(made)
