"""Presets: what the attributes come to for feathers of real birds, and which feathers a bird wears where.

A preset is data (``resources/feathers/NAME.json``): the attributes that differ from the defaults, or from those of the
preset it is like. A name without its side stands for both sides, a colour without its band for a list of three.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.feather.attributes import ATTRIBUTES, COLUMNS, SIDES, defaults
from core.feather.attributes_of_color import BANDS
from core.record import freeze

FOLDER = "feathers"
BIRDS = "birds.json"
KINDS = ("contour", "remex", "rectrix", "down", "semiplume", "filoplume", "bristle")
MOST_LIKE = 8  # presets that are like one another, in a row


class Preset(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A preset as its file has it."""

    title: str
    kind: str
    attributes: dict[str, float | tuple[float, float, float]]
    like: str | None = None


class Bird(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A bird: the preset of its feathers on each part of it; "body" is always there."""

    title: str
    feathers: dict[str, str]


def preset_names() -> list[str]:
    """The names of all presets, sorted."""
    files = (entry.name for entry in (resources.files("resources") / FOLDER).iterdir())
    return sorted(name[:-5] for name in files if name.endswith(".json") and name != BIRDS)


def load_preset(name: str) -> Preset:
    """One preset by its name.

    Raises
    ------
    UserError
        When there is none of that name; the sentence lists those there are.
    """
    if name not in preset_names():
        raise UserError(f"There is no feather {name!r}; there are {', '.join(preset_names())}.")
    return decoded((resources.files("resources") / FOLDER / f"{name}.json").read_bytes(), f"{name}.json")


def decoded(data: bytes, label: str) -> Preset:
    """A preset from the bytes of a file that is called `label`.

    Raises
    ------
    UserError
        When the bytes are no preset, or name an attribute that does not exist or lies outside its range.
    """
    try:
        preset = msgspec.json.decode(data, type=Preset)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{label} is not a feather preset: {error}.") from error
    if preset.kind not in KINDS:
        raise UserError(f"{label}: the kind of a feather is one of {', '.join(KINDS)}, not {preset.kind!r}.")
    _written(preset, defaults(), label)
    return preset


@cache
def preset_values(name: str) -> NDArray[np.float32]:
    """All attributes of the preset of that name, (K,) float32, by column.

    Raises
    ------
    UserError
        When there is no such preset.
    """
    chain: list[Preset] = []
    like: str | None = name
    while like is not None:
        chain.append(load_preset(like))
        like = chain[-1].like
        if len(chain) > MOST_LIKE:
            raise UserError(f"The feather {name} is like itself; take one `like` out of its file.")
    values = defaults()
    for preset in reversed(chain):
        values = _written(preset, values, name)
    return freeze(values)


def bird_names() -> list[str]:
    """The names of all birds."""
    return list(_birds())


def load_bird(name: str) -> Bird:
    """One bird by its name.

    Raises
    ------
    UserError
        When there is none of that name; the sentence lists those there are.
    """
    birds = _birds()
    if name not in birds:
        raise UserError(f"There is no bird {name!r}; there are {', '.join(birds)}.")
    return birds[name]


def bird_values(name: str, part: str = "body") -> NDArray[np.float32]:
    """The attributes (K,) of a bird's feathers on a part of it; those of its body where it has no such part."""
    feathers = load_bird(name).feathers
    return preset_values(feathers.get(part, feathers["body"]))


@cache
def _birds() -> dict[str, Bird]:
    return msgspec.json.decode((resources.files("resources") / FOLDER / BIRDS).read_bytes(), type=dict[str, Bird])


def _written(preset: Preset, values: NDArray[np.float32], label: str) -> NDArray[np.float32]:
    out = values.copy()
    for name, given in preset.attributes.items():
        numbers: dict[str, Any] = {name: given}
        if isinstance(given, tuple):
            numbers = {name + band: value for band, value in zip(BANDS, given, strict=True)}
        elif name not in COLUMNS:
            numbers = {name + side: given for side in SIDES}
        for full, value in numbers.items():
            if full not in COLUMNS:
                raise UserError(f"{label}: a feather has no attribute {name!r}.")
            known = ATTRIBUTES[COLUMNS[full]]
            if not known.low <= value <= known.high:
                raise UserError(f"{label}: {full} goes from {known.low:g} to {known.high:g}, not {value:g}.")
            out[COLUMNS[full]] = value
    return out
