"""Versions of the project format. An older file is brought up one version at a time, a newer one refused by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Raw = dict[str, Any]

FORMAT = 1

# from version -> pure function on the plain JSON dictionary, giving that of the next version
UPGRADES: Mapping[int, Callable[[Raw], Raw]] = {}


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
