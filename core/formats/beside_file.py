"""What is solved beside a plate, as JSON: witness cameras, photographs of the set, things that move by themselves.

A witness: ``{"tracks": FILE, "name", "size", "focal_px", "find_focal", "k1", "k2", "find_k1", "centre"}``, its tracks
named as those of the plate. Photographs: the file of `core/formats/picks_json.py`, its points named as the tracks. A
thing: ``{"mesh": FILE, "points": {TRACK: VERTEX or [x, y, z]}, "name", "tracks": FILE, "loose", "scale"}``; without
tracks of its own those are among the plate's. Vertices count from 0 as in the file, places are metres of the mesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np

from core.errors import UserError
from core.formats.given_file import decoded_json
from core.formats.mesh_file import read_mesh
from core.formats.picks_json import read_picks
from core.formats.track_file import read_tracks
from core.match.photomodel.records import Photomodel
from core.match.solve.things import Given
from core.match.solve.together import Pictures
from core.match.solve.views import Camera
from core.match.track import keyed_track


class _Any(msgspec.Struct):
    photographs: list[msgspec.Raw] | None = None
    tracks: str | None = None


class _Witness(msgspec.Struct, forbid_unknown_fields=True):
    tracks: str
    name: str = "witness"
    size: tuple[int, int] | None = None
    focal_px: float | None = None
    find_focal: bool = False
    k1: float = 0.0
    k2: float = 0.0
    find_k1: bool = False
    centre: tuple[float, float] | None = None


class _Thing(msgspec.Struct, forbid_unknown_fields=True):
    mesh: str
    points: dict[str, int | tuple[float, float, float]]
    name: str | None = None
    tracks: str | None = None
    loose: float = 0.0
    scale: float = 1.0


def is_photographs(path: Path) -> bool:
    """Whether a file is one of photographs, not of a witness.

    Raises
    ------
    UserError
        It is neither.
    """
    found = decoded_json(path, _Any, "a witness camera or photographs")
    if found.photographs is None and found.tracks is None:
        raise UserError(f"{path.name} holds neither tracks of a witness camera nor photographs.")
    return found.photographs is not None


def read_beside(path: Path, sizes: Mapping[Path, tuple[int, int]]) -> list[Pictures]:
    """What other cameras saw; `sizes` in pixels of photographs by their files.

    Raises
    ------
    UserError
        The file is not of this form, or a file it names is not there.
    """
    if is_photographs(path):
        return _of_photographs(read_picks(path, sizes).model)
    one = decoded_json(path, _Witness, "a witness camera")
    given = read_tracks(path.parent / one.tracks, size=one.size or (0, 0))
    size = one.size or given.size
    if size is None or min(size) < 1:
        raise UserError(f'{path.name} does not say how large the pictures are; add "size": [1920, 1080].')
    camera = Camera(size, one.focal_px, one.find_focal, one.k1, one.k2, one.centre, one.find_k1)
    return [Pictures(one.name, camera, tuple(track for track in given.tracks if len(track.frames)))]


def _of_photographs(model: Photomodel) -> list[Pictures]:
    """Those of one camera together."""
    made = []
    for number in sorted({photo.camera for photo in model.photos}):
        photos = [photo for photo in model.photos if photo.camera == number]
        first, own = photos[0], {photo.id for photo in photos}
        if any((photo.width, photo.height) != (first.width, first.height) for photo in photos):
            raise UserError(f"Photographs of camera {number} have different sizes; give each size a camera of its own.")
        tracks, sigma = [], []
        for point in model.points:
            rows = [k for k, photo in enumerate(point.picks.photo) if int(photo) in own]
            if rows:
                keys = np.column_stack([np.asarray(point.picks.photo)[rows], np.asarray(point.picks.xy)[rows]])
                tracks.append(keyed_track(point.id, point.name, keys[np.argsort(keys[:, 0])]))
                sigma.append(point.sigma)
        if tracks:
            camera = Camera(
                (first.width, first.height), first.focal_px, first.find_focal, first.k1, first.k2, first.centre)
            made.append(Pictures(
                "photograph", camera, tuple(tracks), {photo.id: photo.name for photo in photos}, np.array(sigma)))
    return made


def read_thing(path: Path, size: tuple[int, int]) -> Given:
    """A thing that moves by itself before a plate of `size`.

    Raises
    ------
    UserError
        The file is not of this form, a file it names is not there, or a vertex is not in the mesh.
    """
    one = decoded_json(path, _Thing, "a thing that moves")
    file = read_mesh(path.parent / one.mesh)
    places = np.zeros((len(one.points), 3))
    for row, (name, place) in enumerate(one.points.items()):
        if isinstance(place, int):
            if not 0 <= place < len(file.vertex_of_file) or file.vertex_of_file[place] < 0:
                raise UserError(f"{path.name}: {one.mesh} has no vertex {place}, where {name} should be.")
            places[row] = file.mesh.points[file.vertex_of_file[place]]
        else:
            places[row] = place
    if not (np.isfinite(places).all() and np.isfinite([one.loose, one.scale]).all()):
        raise UserError(f"{path.name} holds numbers that are not finite.")
    if one.scale <= 0.0 or one.loose < 0.0:
        raise UserError(f"{path.name}: scale is above 0, loose is 0 or more.")
    tracks = () if one.tracks is None else read_tracks(path.parent / one.tracks, size=size).tracks
    return Given(one.name or path.stem, file.mesh, tuple(one.points), places, tracks, one.loose, one.scale)
