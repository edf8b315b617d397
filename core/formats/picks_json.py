"""A model from photographs as JSON: who took them, what was picked, what is known, what is built.

``{"photographs": [{"name", "path" or "size", "focal_px", "find_focal", "k1", "k2", "centre", "camera"}],
"points": [{"name", "picks": {PHOTOGRAPH: [x, y]}, "sigma"}],
"lines": [{"name", "points": [A, B], "picks": [[PHOTOGRAPH, x, y]]}],
"circles": [{"name", "picks": [[PHOTOGRAPH, x, y]], "points": []}],
"known": [{"kind", "points", "value", "sigma"}],
"frame": {"origin", "axis", "plane", "distance", "length"},
"parts": [{"name", "kind", "points", "parts", "value"}]}``

Photographs, points and parts are called by their names.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec

from core.errors import UserError
from core.formats.given_file import decoded_json
from core.match.photomodel.records import (
    Known,
    ModelCircle,
    ModelLine,
    ModelPoint,
    Part,
    Photo,
    Photomodel,
    WorldFrame,
    picked,
)

Spot = tuple[str, float, float]


class _Photo(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    path: str | None = None
    size: tuple[int, int] | None = None
    focal_px: float | None = None
    find_focal: bool = False
    k1: float = 0.0
    k2: float = 0.0
    centre: tuple[float, float] | None = None
    camera: int = 1


class _Point(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    picks: dict[str, tuple[float, float]] = {}
    sigma: float = 1.0


class _Line(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    points: tuple[str, str]
    picks: list[Spot] = []
    sigma: float = 1.0


class _Circle(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    picks: list[Spot] = []
    points: list[str] = []
    sigma: float = 1.0


class _Known(msgspec.Struct, forbid_unknown_fields=True):
    kind: str
    points: list[str]
    value: list[float] = []
    sigma: float = 0.0


class _Frame(msgspec.Struct, forbid_unknown_fields=True):
    origin: str | None = None
    axis: tuple[str, str] | None = None
    plane: list[str] | None = None
    distance: tuple[str, str] | None = None
    length: float = 1.0


class _Part(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    kind: str
    points: list[str] = []
    parts: list[str] = []
    value: list[float] = []


class _File(msgspec.Struct, forbid_unknown_fields=True):
    photographs: list[_Photo]
    points: list[_Point]
    lines: list[_Line] = []
    circles: list[_Circle] = []
    known: list[_Known] = []
    frame: _Frame | None = None
    parts: list[_Part] = []


class Picks(msgspec.Struct):
    """model : with photographs of no plate. paths : of the photographs that name a file, by their ids."""

    model: Photomodel
    paths: dict[int, Path]


def read_picks(path: Path, sizes: Mapping[Path, tuple[int, int]] | None = None) -> Picks:
    """Read a model; `sizes` in pixels of the photographs' files (see :func:`photographs_of`).

    Raises
    ------
    UserError
        The file is not of this form, or names what is not in it; the message says where.
    """
    file = decoded_json(path, _File, "a model of photographs")
    sizes = sizes or {}
    photos: list[Photo] = []
    paths: dict[int, Path] = {}
    try:
        for number, one in enumerate(file.photographs, 1):
            where = None if one.path is None else path.parent / one.path
            size = one.size or (sizes.get(where) if where is not None else None)
            if size is None:
                raise UserError(f"{path.name}: the photograph {one.name!r} needs a path or a size.")
            if where is not None:
                paths[number] = where
            photos.append(Photo(
                id=number, name=one.name, width=size[0], height=size[1], camera=one.camera, focal_px=one.focal_px,
                find_focal=one.find_focal, k1=one.k1, k2=one.k2, centre=one.centre,
            ))
        return Picks(_model(path.stem, file, photos), paths)
    except ValueError as error:
        raise UserError(f"{path.name}: {error}.") from None
    except KeyError as error:
        raise UserError(f"{path.name} names {error.args[0]!r}, which is not in it.") from None


def photographs_of(path: Path) -> list[Path]:
    """The files of the photographs a model names, so that their sizes can be looked up."""
    file = decoded_json(path, _File, "a model of photographs")
    return [path.parent / one.path for one in file.photographs if one.path is not None]


def _model(name: str, file: _File, photos: list[Photo]) -> Photomodel:
    shot = _numbered([photo.name for photo in photos])
    point = _numbered([one.name for one in file.points])
    part = _numbered([one.name for one in file.parts])

    def spots(picks: list[Spot]) -> tuple[list[int], list[tuple[float, float]]]:
        return [shot[spot[0]] for spot in picks], [spot[1:] for spot in picks]

    frame = file.frame or _Frame()
    return Photomodel(
        id=1, name=name, photos=tuple(photos),
        points=tuple(ModelPoint(
            id=point[one.name], name=one.name, sigma=one.sigma,
            picks=picked([shot[key] for key in one.picks], list(one.picks.values())),
        ) for one in file.points),
        lines=tuple(ModelLine(
            id=k, name=one.name, points=(point[one.points[0]], point[one.points[1]]), sigma=one.sigma,
            picks=picked(*spots(one.picks)),
        ) for k, one in enumerate(file.lines, 1)),
        circles=tuple(ModelCircle(
            id=k, name=one.name, picks=picked(*spots(one.picks)), points=tuple(point[key] for key in one.points),
            sigma=one.sigma,
        ) for k, one in enumerate(file.circles, 1)),
        known=tuple(Known(
            kind=one.kind, points=tuple(point[key] for key in one.points), value=tuple(one.value), sigma=one.sigma,
        ) for one in file.known),
        frame=WorldFrame(
            origin=None if frame.origin is None else point[frame.origin],
            axis=None if frame.axis is None else (point[frame.axis[0]], point[frame.axis[1]]),
            plane=None if frame.plane is None else tuple(point[key] for key in frame.plane),
            distance=None if frame.distance is None else (point[frame.distance[0]], point[frame.distance[1]]),
            length=frame.length,
        ),
        parts=tuple(Part(
            id=part[one.name], name=one.name, kind=one.kind, points=tuple(point[key] for key in one.points),
            parts=tuple(part[key] for key in one.parts), value=tuple(one.value),
        ) for one in file.parts),
    )


def _numbered(names: list[str]) -> dict[str, int]:
    numbers = {name: k for k, name in enumerate(names, 1)}
    if len(numbers) < len(names):
        raise ValueError(f"the name {next(name for name in names if names.count(name) > 1)!r} is given twice")
    return numbers
