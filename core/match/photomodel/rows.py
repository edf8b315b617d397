"""A model as the solver sees it: photographs are frames, points are tracks.

What is picked along a line or a circle is a point of its own, seen once, that a constraint keeps on its shape.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.match.photomodel.records import Photo, Photomodel
from core.match.solve.constraints import Constraint
from core.match.solve.state import K1, Array, Flags, Observations, State, bearings, projected, start_lens
from core.match.solve.views import Camera, Views


class Table(NamedTuple):
    """views : a camera of the solver for each group of photographs. observations : of all picks, sorted by photograph.

    points : number of the model's points; rows beyond are picks along shapes.
    along_lines, along_circles : for each line and circle the rows of its picks.
    pick : (N, 2) int32 what was picked (0 point, 1 line, 2 circle) and its row, of each observation.
    """

    views: Views
    observations: Observations
    points: int
    tracks: int
    along_lines: tuple[tuple[int, ...], ...]
    along_circles: tuple[tuple[int, ...], ...]
    pick: NDArray[np.int32]


def lens_of(photo: Photo) -> Array:
    """The lens of a photograph in its own pixels; its focal length is that of a usual one where nobody knows."""
    lens = start_lens(photo.focal_px or float(max(photo.width, photo.height)), photo.width, photo.height)
    lens[K1 : K1 + 2] = photo.k1, photo.k2
    if photo.centre is not None:
        lens[4:6] = photo.centre
    return lens


def seen_by(photo: Photo, points: Array) -> tuple[Array, Array]:
    """Pixels (N, 2) of the photograph and depths (N,) of points (N, 3); it must be solved."""
    assert photo.rotation is not None
    assert photo.translation is not None
    state = State(photo.rotation[None], np.array([photo.translation]), points, np.zeros(1), lens_of(photo))
    return projected(state, np.zeros(len(points), np.int32), points)


def ray(photo: Photo, xy: Array) -> tuple[Array, Array]:
    """Where a solved photograph stands (3,) and unit directions (N, 3) in the world of its pixels (N, 2)."""
    assert photo.rotation is not None
    assert photo.translation is not None
    directions = bearings(lens_of(photo), 0.0, xy) @ photo.rotation
    return -photo.rotation.T @ np.array(photo.translation), directions / np.linalg.norm(directions, axis=1)[:, None]


def views_of(model: Photomodel) -> Views:
    """Photographs of one number and size share a camera."""
    groups: dict[tuple[int, int, int, float, float], int] = {}
    cameras: list[Camera] = []
    rows: list[int] = []
    for photo in model.photos:
        key = (photo.camera, photo.width, photo.height, photo.k1, photo.k2)
        if key not in groups:
            groups[key] = len(cameras)
            cameras.append(Camera(
                (photo.width, photo.height), photo.focal_px, photo.find_focal or photo.focal_px is None, photo.k1,
                photo.k2, photo.centre,
            ))
        rows.append(groups[key])
    return Views(np.ones(len(rows), bool), np.array(rows, np.int32), tuple(cameras))


def table_of(model: Photomodel) -> Table:
    """All picks of a model as observations."""
    place = {photo.id: row for row, photo in enumerate(model.photos)}
    frame: list[int] = []
    track: list[int] = []
    xy: list[Array] = []
    sigma: list[float] = []
    pick: list[tuple[int, int]] = []
    tracks = len(model.points)
    along: list[list[tuple[int, ...]]] = [[], [], []]
    picked: tuple[tuple[Any, ...], ...] = (model.points, model.lines, model.circles)
    for kind, items in enumerate(picked):
        for row, item in enumerate(items):
            count = len(item.picks.photo)
            rows = [row] * count if kind == 0 else list(range(tracks, tracks + count))
            tracks += count if kind else 0
            along[kind].append(tuple(rows))
            frame += [place[int(photo)] for photo in item.picks.photo]
            track += rows
            xy += list(item.picks.xy)
            sigma += [item.sigma] * count
            pick += [(kind, row)] * count
    order = np.argsort(np.array(frame, np.int32), kind="stable")
    weight = 1.0 / np.array(sigma, np.float64)
    observations = Observations(
        np.array(frame, np.int32), np.array(track, np.int32), np.array(xy, np.float64).reshape(-1, 2),
        np.stack([weight, np.zeros(len(weight)), weight], axis=1),
    ).take(order)
    return Table(
        views_of(model), observations, len(model.points), tracks, tuple(along[1]), tuple(along[2]),
        np.array(pick, np.int32).reshape(-1, 2)[order],
    )


def constraints_of(model: Photomodel, table: Table, placed: Flags) -> list[Constraint]:
    """What is known of points and shapes, of those that have a place (tracks,)."""
    rows = {point.id: row for row, point in enumerate(model.points)}
    found = [Constraint(known.kind, tuple(rows[id_] for id_ in known.points), known.value, known.sigma)
             for known in model.known]
    for line, along in zip(model.lines, table.along_lines, strict=True):
        on = tuple(row for row in along if placed[row])
        if on:
            found.append(Constraint("line", (*(rows[id_] for id_ in line.points), *on)))
    for circle, along in zip(model.circles, table.along_circles, strict=True):
        on = (*(row for row in along if placed[row]), *(rows[id_] for id_ in circle.points))
        if len(on) >= 4:
            found.append(Constraint("circle", on))
    return [one for one in found if all(placed[row] for row in one.points)]
