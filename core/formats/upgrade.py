"""Versions of the project format. An older file is brought up one version at a time, a newer one refused by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Raw = dict[str, Any]

FORMAT = 9

VALUES_OF_2 = ("density", "width_root", "width_tip", "clump", "frizz", "length_variation")  # of a coat; plain before


def coats_of_values(raw: Raw) -> Raw:
    """1 -> 2: six plain numbers of every coat become constants, as its length already was.

    What has not the expected form is left alone, for decoding to refuse with the path of the field.
    """

    def constant(number: Any) -> Any:
        if isinstance(number, bool) or not isinstance(number, int | float):
            return number
        return {"base": {"type": "constant", "number": number}, "map": None}

    def groom(old: Any) -> Any:
        coat = old.get("coat") if isinstance(old, dict) else None
        if not isinstance(coat, dict):
            return old
        return {**old, "coat": {key: constant(v) if key in VALUES_OF_2 else v for key, v in coat.items()}}

    document = raw.get("document")
    if not isinstance(document, dict) or not isinstance(document.get("grooms"), list):
        return raw
    return {**raw, "document": {**document, "grooms": [groom(old) for old in document["grooms"]]}}


def held_poses(raw: Raw) -> Raw:
    """2 -> 3: meshes may hold a pose and workspaces a craft; as there were none, nothing is to be changed."""
    return raw


def aligned_handles(raw: Raw) -> Raw:
    """3 -> 4: tangents of keys may be "aligned"; as none were, nothing is to be changed."""
    return raw


def shaped_tracks(raw: Raw) -> Raw:
    """4 -> 5: planes, masks, and tracks with a shape, an offset and settings of their own; as none were, nothing is."""
    return raw


def keyed_clips(raw: Raw) -> Raw:
    """5 -> 6: clips know the samples that poses were keyed at; as there were none, nothing is to be changed."""
    return raw


def selected_tracks(raw: Raw) -> Raw:
    """6 -> 7: tracks may be selected; as none were, nothing is to be changed."""
    return raw


def feathered_meshes(raw: Raw) -> Raw:
    """7 -> 8: documents may hold coats of feathers; as there were none, nothing is to be changed."""
    return raw


def winged_coats(raw: Raw) -> Raw:
    """8 -> 9: coats may have wings, and ids of feathers set by hand; as none had, nothing is to be changed."""
    return raw


# from version -> pure function on the plain JSON dictionary, giving that of the next version
UPGRADES: Mapping[int, Callable[[Raw], Raw]] = {
    1: coats_of_values, 2: held_poses, 3: aligned_handles, 4: shaped_tracks, 5: keyed_clips, 6: selected_tracks,
    7: feathered_meshes, 8: winged_coats}


def upgrade(raw: Raw, upgrades: Mapping[int, Callable[[Raw], Raw]] = UPGRADES, latest: int = FORMAT) -> Raw:
    """The dictionary of a project file in the `latest` format.

    Raises
    ------
    ValueError
        No version number, a newer one than `latest`, or one that no upgrade leads on from.
    """
    version = raw.get("format")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ValueError("it does not say which version of the format it is")
    if version > latest:
        raise ValueError(
            f"it was written by a newer Filoplume (format {version}, this one reads up to {latest}); "
            "update Filoplume, or save it in an older format there"
        )
    while version < latest:
        if version not in upgrades:
            raise ValueError(f"its format {version} is too old to be read")
        raw = {**upgrades[version](raw), "format": version + 1}
        version += 1
    return raw
