"""A model of photographs over the photograph in view: picks, where points are foretold, the guide, what is built."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.window.match.marks import Sheet
from core.document import Document
from core.errors import UserError
from core.match.photomodel.build import built
from core.match.photomodel.guide import epipolar_line, foretold
from core.match.photomodel.records import Known, ModelCircle, ModelPoint, Photo, Photomodel
from core.match.photomodel.rows import seen_by
from core.overlay import Circle, Label, Marker, Overlay, Overlays, Polyline, Tone
from tools.photomodel_edits import active_point, model_of, photo_of, points_in_hand

Array = NDArray[np.float64]
OFF = 2.0  # times the sharpness of a pick by which it may miss before it is shown as trouble
TONES: tuple[Tone, ...] = ("x", "y", "z")
GRID = 8  # squares of the ground to each side of the origin
ROUND = np.linspace(0.0, 2.0 * np.pi, 65)


def model_marks(document: Document, sheet: Sheet) -> Overlays:
    """Everything of the model that is worked on, in the photograph of a sheet."""
    model = model_of(document)
    photo = None if model is None else photo_of(model, sheet.plate.id, sheet.frame)
    if model is None or photo is None:
        return ()
    out: list[Overlay] = []
    for known in model.known:
        if known.kind == "axis":
            out += _along(model, known, photo, sheet)
    if photo.rotation is not None:
        if any(known.kind == "axis" for known in model.known):
            out += _ground(photo, sheet)
        out += _edges(model, photo, sheet)
        for circle in model.circles:
            out += _circle(circle, photo, sheet)
    out += _guide(model, photo, sheet)
    for picks in (*(line.picks for line in model.lines), *(circle.picks for circle in model.circles)):
        for place in picks.xy[picks.photo == photo.id]:
            x, y = sheet.at(place[None])[0]
            out.append(Circle(float(x), float(y), 3.5 * sheet.ratio, "accent"))
    chosen = points_in_hand(model)
    for point in model.points:
        out += _point(model, point, photo, sheet, point.id in chosen)
    return tuple(out)


def misses(model: Photomodel) -> dict[int, float]:
    """By how many pixels the picks of each point that has a place miss it, root mean square."""
    photos = {photo.id: photo for photo in model.photos if photo.rotation is not None}
    found: dict[int, float] = {}
    for point in model.points:
        if point.place is not None:
            away = [float(np.linalg.norm(seen_by(photos[id_], np.array([point.place]))[0][0] - xy))
                    for id_, xy in zip(point.picks.photo.tolist(), point.picks.xy, strict=True) if id_ in photos]
            if away:
                found[point.id] = float(np.sqrt(np.mean(np.square(away))))
    return found


def _point(model: Photomodel, point: ModelPoint, photo: Photo, sheet: Sheet, selected: bool) -> list[Overlay]:
    """The pick of a point with the way to where its place is seen; without a pick the place that is foretold."""
    there = foretold(model, point.id, photo.id)
    at = np.flatnonzero(point.picks.photo == photo.id)
    ratio = sheet.ratio
    if not len(at):
        if there is None:
            return []
        x, y = (float(v) for v in sheet.at(np.array([there]))[0])
        tone: Tone = "selected" if selected else "faint"
        out: list[Overlay] = [Circle(x, y, (8.0 if selected else 5.0) * ratio, tone)]
        return [*out, Label(x + 10.0 * ratio, y - 6.0 * ratio, f"{point.name} here?", tone, True)] if selected else out
    pick = point.picks.xy[at[0]]
    miss = 0.0 if there is None else float(np.linalg.norm(np.array(there) - pick))
    tone = "selected" if selected else "accent" if there is None else "trouble" if miss > OFF * point.sigma else "good"
    x, y = (float(v) for v in sheet.at(pick[None])[0])
    out = [Marker(x, y, (15.0 if selected else 10.0) * ratio, tone)]
    if there is not None and miss * sheet.scale > 1.0:
        out.append(Polyline(sheet.at(np.array([pick, there])), "trouble", 1.5))
    if selected:
        words = point.name if there is None else f"{point.name}  {miss:.2f} px"
        out.append(Label(x + 8.0 * ratio, y - 6.0 * ratio, words, tone, True))
    return out


def _along(model: Photomodel, known: Known, photo: Photo, sheet: Sheet) -> list[Overlay]:
    """An edge that is known to lie along an axis, in the colour of that."""
    picks = [point.picks for id_ in known.points for point in model.points if point.id == id_]
    ends = [one.xy[one.photo == photo.id] for one in picks]
    if not all(len(one) for one in ends):
        return []
    return [Polyline(sheet.at(np.concatenate(ends)), TONES[int(np.argmax(np.abs(known.value)))], 2.0)]


def _ground(photo: Photo, sheet: Sheet) -> list[Overlay]:
    """The horizon, a grid about the origin of the ground and the axes there, by the camera of a photograph."""
    assert photo.rotation is not None
    assert photo.translation is not None
    eye = -photo.rotation.T @ np.array(photo.translation)
    step = 10.0 ** np.floor(np.log10(max(float(np.linalg.norm(eye)), 1e-9))) / 2.0
    out: list[Overlay] = []
    ways = np.linspace(0.0, 2.0 * np.pi, 145)
    far = eye + 1e6 * step * np.stack([np.cos(ways), np.zeros(145), np.sin(ways)], axis=1)
    out += _lines(far, photo, sheet, "plain", dashed=True)
    along = np.linspace(-GRID, GRID, 8 * GRID + 1) * step
    for k in range(-GRID, GRID + 1):
        across = np.full_like(along, k * step)
        level = np.zeros_like(along)
        for line in (np.stack([across, level, along], axis=1), np.stack([along, level, across], axis=1)):
            out += _lines(line, photo, sheet, "faint")
    for axis, tone in enumerate(TONES):
        line = np.zeros((33, 3))
        line[:, axis] = np.linspace(0.0, 2.0 * step, 33)
        out += _lines(line, photo, sheet, tone, width=2.5)
    return out


def _lines(
    points: Array, photo: Photo, sheet: Sheet, tone: Tone, width: float = 1.0, *, dashed: bool = False,
) -> list[Overlay]:
    """The pieces of a line through points of the world that lie before the camera and about the picture."""
    pixels, ahead = seen_by(photo, points)
    size = np.array([photo.width, photo.height])
    seen = (ahead > 0.0) & (np.abs(pixels - 0.5 * size) < size).all(axis=1)
    rows = np.flatnonzero(seen)
    pieces = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    return [Polyline(sheet.at(pixels[piece]), tone, width, dashed=dashed) for piece in pieces if len(piece) > 1]


def _guide(model: Photomodel, photo: Photo, sheet: Sheet) -> list[Overlay]:
    """Where the point in hand can be that has no place yet: a line for each photograph it is picked in."""
    row = active_point(model)
    if row is None:
        return []
    point = model.points[row]
    if point.place is not None or photo.id in point.picks.photo:
        return []
    lines = [epipolar_line(model, int(id_), (float(xy[0]), float(xy[1])), photo.id)
             for id_, xy in zip(point.picks.photo, point.picks.xy, strict=True)]
    return [Polyline(sheet.at(line), "selected", 1.5, dashed=True) for line in lines if len(line) > 1]


def _edges(model: Photomodel, photo: Photo, sheet: Sheet) -> list[Overlay]:
    """Edges of what is built, where both ends are before the camera."""
    try:
        mesh = built(model)
    except UserError:  # nothing is built, or a point of it has lost its place: the picks are shown without
        return []
    pixels, ahead = seen_by(photo, mesh.points.astype(np.float64))
    ends = np.cumsum(mesh.counts)
    edges = {
        (min(a, b), max(a, b))
        for first, last in zip(ends - mesh.counts, ends, strict=True)
        for a, b in zip(mesh.corners[first:last].tolist(), np.roll(mesh.corners[first:last], -1).tolist(), strict=True)}
    at = sheet.at(pixels)
    return [Polyline(at[[a, b]], "good", 1.5) for a, b in sorted(edges) if ahead[a] > 0.0 and ahead[b] > 0.0]


def _circle(circle: ModelCircle, photo: Photo, sheet: Sheet) -> list[Overlay]:
    """The outline of a circle that has a place."""
    if circle.centre is None or circle.normal is None or circle.radius is None:
        return []
    across = np.linalg.svd(np.array([circle.normal]))[2][1:]
    ring = np.array(circle.centre) + circle.radius * (np.cos(ROUND)[:, None] * across[0]
                                                      + np.sin(ROUND)[:, None] * across[1])
    pixels, ahead = seen_by(photo, ring)
    return [Polyline(sheet.at(pixels), "good", 1.5)] if (ahead > 0.0).all() else []
