"""Edits of plates and tracks: pure functions from documents to documents, for a hand, a macro and a script alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.document import FRAMES, Document, free_id
from core.errors import UserError
from core.image.plate import Plate
from core.match import edits
from core.match.outline import Mask
from core.match.track import PlaneTrack, Track
from core.record import freeze


def shown_plate(document: Document) -> Plate | None:
    """The plate that is looked at and tracked: the first that is not hidden."""
    return next((plate for plate in document.plates if not plate.hidden), None)


def place_at(track: Track, frame: int) -> NDArray[np.float64] | None:
    """Where a track is (2,) on a frame as files count, or None where it is not seen."""
    at = int(np.searchsorted(track.frames, frame))
    return track.points[at] if at < len(track.frames) and track.frames[at] == frame else None


def free_track(tracks: tuple[Track, ...]) -> int:
    """An id that no track has."""
    return free_id(tracks)


def with_track(tracks: tuple[Track, ...], track: Track) -> tuple[Track, ...]:
    """The tracks with this one in place of that of its id, or at the end."""
    if any(have.id == track.id for have in tracks):
        return tuple(track if have.id == track.id else have for have in tracks)
    return (*tracks, track)


def selected_with(selection: tuple[int, ...], track_id: int) -> tuple[int, ...]:
    """The selection with one more track, or without it when it was the active one of it already."""
    rest = tuple(i for i in selection if i != track_id)
    return rest if track_id in selection else (*rest, track_id)


def add_plate(document: Document, plate: Plate) -> Document:
    """The document with a plate in view: earlier ones are hidden, the timeline is that of the plate."""
    added = plate.replace(id=free_id(document.plates), path=Path(plate.path).as_posix())
    first, last = (min(max(n + plate.offset, FRAMES[0]), FRAMES[1]) for n in (plate.first, plate.last))
    changed: Document = document.replace(
        plates=(*(old if old.hidden else old.replace(hidden=True) for old in document.plates), added),
        first_frame=first, last_frame=last, fps=plate.fps if plate.movie else document.fps)
    return changed


def show_plate(document: Document, plate_id: int) -> Document:
    """The document with that plate in view and the others hidden."""
    if not any(plate.id == plate_id for plate in document.plates):
        raise UserError(f"There is no plate {plate_id}; choose one of {[p.id for p in document.plates]}.")
    changed: Document = document.replace(plates=tuple(p.replace(hidden=p.id != plate_id) for p in document.plates))
    return changed


def put_tracks(document: Document, tracks: tuple[Track, ...]) -> Document:
    """The document with these tracks in place of those of their ids, or added."""
    changed: Document = document.replace(tracks=_all_put(document.tracks, tracks))
    return changed


def add_tracks(document: Document, tracks: tuple[Track, ...], plate_id: int) -> Document:
    """The document with tracks of a file or of the finder of features, under new ids, on a plate; they are selected."""
    first = free_track(document.tracks)
    made = tuple(track.replace(id=first + n, plate_id=plate_id) for n, track in enumerate(tracks))
    changed: Document = document.replace(
        tracks=(*document.tracks, *made), track_selection=tuple(track.id for track in made))
    return changed


def select_tracks(document: Document, ids: tuple[int, ...]) -> Document:
    """The document with just these tracks selected, the last one active."""
    wanted = tuple(dict.fromkeys(ids))
    if wanted == document.track_selection:
        return document
    changed: Document = document.replace(track_selection=wanted)
    return changed


def selected_tracks(document: Document) -> tuple[Track, ...]:
    """The selected tracks in the order of selection, the active one last."""
    by_id = {track.id: track for track in document.tracks}
    return tuple(by_id[i] for i in document.track_selection if i in by_id)


def delete_tracks(document: Document, ids: tuple[int, ...]) -> Document:
    """The document without these tracks; UserError for locked ones."""
    _free(document, ids)
    changed: Document = document.replace(
        tracks=tuple(track for track in document.tracks if track.id not in ids),
        track_selection=tuple(i for i in document.track_selection if i not in ids))
    return changed


def set_tracks(document: Document, ids: tuple[int, ...], *, hidden: bool | None = None,
               locked: bool | None = None) -> Document:
    """The document with these tracks hidden or shown, locked or free."""
    told = {name: value for name, value in (("hidden", hidden), ("locked", locked)) if value is not None}
    return put_tracks(document, tuple(t.replace(**told) for t in document.tracks if t.id in ids))


def rename_track(document: Document, track_id: int, name: str) -> Document:
    """The document with another name for a track."""
    return put_tracks(document, tuple(t.replace(name=name) for t in _free(document, (track_id,))))


def join(document: Document, ids: tuple[int, ...]) -> Document:
    """The document with these tracks made one, that of the first; they follow the same point."""
    tracks = _free(document, ids, 2)
    joined = tracks[0]
    for track in tracks[1:]:
        joined = edits.join_tracks(joined, track)
    rest = delete_tracks(document, tuple(t.id for t in tracks[1:]))
    return select_tracks(put_tracks(rest, (joined,)), (joined.id,))


def average(document: Document, ids: tuple[int, ...]) -> Document:
    """The document with a new track of the mean of these."""
    made = edits.average_tracks(_free(document, ids, 2))
    number = free_track(document.tracks)
    added = put_tracks(document, (made.replace(id=number, name=f"average_{number:02d}"),))
    return select_tracks(added, (number,))


def split(document: Document, ids: tuple[int, ...], frame: int) -> Document:
    """The document with these tracks cut in two before a frame, as files count."""
    made: list[Track] = []
    number = free_track(document.tracks)
    for track in _free(document, ids):
        made += edits.split_track(track, frame, number, f"{track.name}b"[:255])
        number += 1
    return put_tracks(document, tuple(made))


def smooth(document: Document, ids: tuple[int, ...], length: int = 5) -> Document:
    """The document with these tracks smoothed over so many frames; keys stay."""
    return put_tracks(document, tuple(edits.smooth_track(track, length) for track in _free(document, ids)))


def key(document: Document, ids: tuple[int, ...], frame: int) -> Document:
    """The document with keys on a frame where these tracks are there: patterns are cut anew from it."""
    made = []
    for track in _free(document, ids):
        place = place_at(track, frame)
        if place is None:
            raise UserError(f"Track {track.name} is not seen on frame {frame}; drag it to its place there.")
        made.append(edits.key_track(track, frame, (float(place[0]), float(place[1]))))
    return put_tracks(document, tuple(made))


def remove_keys(document: Document, ids: tuple[int, ...], frame: int) -> Document:
    """The document without the keys of these tracks on a frame; the last key of a track stays."""
    made = []
    for track in _free(document, ids):
        rest = track.keys[track.keys[:, 0] != frame]
        if not len(rest):
            raise UserError(f"Frame {frame} holds the only key of track {track.name}; delete the track itself.")
        made.append(track.replace(keys=freeze(rest.copy())))
    return put_tracks(document, tuple(made))


def clear(document: Document, ids: tuple[int, ...], frame: int, *, after: bool) -> Document:
    """The document with these tracks forgotten after (or before) a frame."""
    made = []
    for track in _free(document, ids):
        keep, keys = (
            (track.frames <= frame, track.keys[:, 0] <= frame) if after
            else (track.frames >= frame, track.keys[:, 0] >= frame))
        if not keys.any():
            raise UserError(f"No key of track {track.name} would be left; key it on frame {frame} first.")
        columns = {name: freeze(getattr(track, name)[keep].copy()) for name in edits.COLUMNS}
        made.append(track.replace(keys=freeze(track.keys[keys].copy()), **columns))
    return put_tracks(document, tuple(made))


def nudge(document: Document, ids: tuple[int, ...], frame: int, x: float, y: float) -> Document:
    """The document with these tracks moved by pixels of the plate on a frame, where that sets keys."""
    made = []
    for track in _free(document, ids):
        place = place_at(track, frame)
        if place is None:
            raise UserError(f"Track {track.name} is not seen on frame {frame}; drag it to its place there.")
        made.append(edits.key_track(track, frame, (float(place[0] + x), float(place[1] + y))))
    return put_tracks(document, tuple(made))


def put_planes(document: Document, planes: tuple[PlaneTrack, ...]) -> Document:
    """The document with these planes in place of those of their ids."""
    by_id = {plane.id: plane for plane in planes}
    changed: Document = document.replace(planes=tuple(by_id.get(p.id, p) for p in document.planes))
    return changed


def delete_shapes(document: Document, frame: int) -> Document:
    """The document without the planes and masks of the plate in view that are seen on a frame and not locked."""
    plate = shown_plate(document)
    here = 0 if plate is None else plate.id
    planes = tuple(p for p in document.planes if p.plate_id != here or p.locked or frame not in p.frames)
    masks = tuple(m for m in document.masks if m.plate_id != here or m.locked)
    if len(planes) == len(document.planes) and len(masks) == len(document.masks):
        raise UserError("There is no plane or mask here that could be deleted.")
    changed: Document = document.replace(planes=planes, masks=masks)
    return changed


def delete_marks(document: Document, planes: tuple[int, ...], masks: tuple[int, ...]) -> Document:
    """The document without these planes and masks; UserError for a locked one."""
    gone: tuple[PlaneTrack | Mask, ...] = (
        *(p for p in document.planes if p.id in planes), *(m for m in document.masks if m.id in masks))
    locked = next((mark.name for mark in gone if mark.locked), None)
    if locked is not None:
        raise UserError(f"{locked} is locked; unlock it first.")
    if not gone:
        raise UserError("No plane or mask is chosen; click one in the list.")
    changed: Document = document.replace(planes=tuple(p for p in document.planes if p.id not in planes),
                                         masks=tuple(m for m in document.masks if m.id not in masks))
    return changed


def set_marks(document: Document, planes: tuple[int, ...], masks: tuple[int, ...], *, hidden: bool | None = None,
              locked: bool | None = None) -> Document:
    """The document with these planes and masks hidden or shown, locked or free."""
    told = {name: value for name, value in (("hidden", hidden), ("locked", locked)) if value is not None}
    changed: Document = document.replace(
        planes=tuple(p.replace(**told) if p.id in planes else p for p in document.planes),
        masks=tuple(m.replace(**told) if m.id in masks else m for m in document.masks))
    return changed


def _all_put(tracks: tuple[Track, ...], new: tuple[Track, ...]) -> tuple[Track, ...]:
    for track in new:
        tracks = with_track(tracks, track)
    return tracks


def _free(document: Document, ids: tuple[int, ...], least: int = 1) -> tuple[Track, ...]:
    """These tracks in the order of `ids`, at least so many, none of them locked."""
    by_id = {track.id: track for track in document.tracks}
    found = tuple(by_id[i] for i in dict.fromkeys(ids) if i in by_id)
    if len(found) < least:
        raise UserError("No track is selected; click one." if least == 1 else "Select two tracks or more; Shift adds.")
    locked = next((track.name for track in found if track.locked), None)
    if locked is not None:
        raise UserError(f"Track {locked} is locked; unlock it first.")
    return found
