"""The plate of the demo of matchmove: the shot of `core/demo/shot.py` drawn dark and grainy, and what is seen in it."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.demo.shot import (
    BOXES,
    FIRST,
    FOCAL,
    MARK,
    ROOM_MARK,
    SIZE,
    Figure,
    Moment,
    ball,
    figure_points,
    room_marks,
)
from core.formats.atomic import atomic_write
from core.mesh.bvh import build_bvh, hit_segments
from core.mesh.normals import mesh_normals
from core.mesh.triangulate import triangulate
from core.random import rand
from viewport.context import temporary_context
from viewport.picture import render
from viewport.scene import Lights, Scene, Surface

EXPOSURE, GRAIN = 0.16, 2.2  # dark, with noise of so many levels of 255
FACING = 0.45  # cosine to the view: marks that are seen more from the side are not tracked
EDGE = 14.0  # pixels


def draw_plate(folder: Path, model: Figure, truth: list[Moment]) -> list[NDArray[np.uint8]]:
    """Draw and write every frame, dark and with grain."""
    triangles = triangulate(model.mesh).vertices
    pictures = []
    with temporary_context() as ctx:
        for row, moment in enumerate(truth):
            points = figure_points(model, moment)
            normals = mesh_normals(model.mesh, points)
            surfaces = [Surface(points, normals, triangles, (0.42, 0.33, 0.27))]
            marks = [(points[v].astype(np.float64), MARK) for part in (model.head, model.neck, model.body)
                     for v in part.vertices.values()]
            marks += [(place, ROOM_MARK) for place in room_marks().values()]
            surfaces += [balls(marks), *_room()]
            lights = Lights(follow_camera=False)
            scene = Scene(tuple(surfaces), lights=lights, background=((0.02, 0.02, 0.03), (0.01, 0.01, 0.01)),
                          exposure=EXPOSURE)
            view = Camera(world_from_camera=moment.camera, field_of_view=float(2.0 * np.arctan2(0.5 * SIZE[1], FOCAL)))
            picture = _grain(render(scene, view, *SIZE, ctx=ctx), row)
            pictures.append(picture)
            write_picture(folder / f"plate.{FIRST + row}.png", picture)
    return pictures


def balls(marks: list[tuple[NDArray[np.float64], float]]) -> Surface:
    """Bright balls in one surface."""
    unit, quads = ball()
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    points = np.concatenate([place + radius * unit for place, radius in marks])
    rows = np.concatenate([triangles + k * len(unit) for k in range(len(marks))])
    normals = np.tile(unit, (len(marks), 1)).astype(np.float32)
    return Surface(points.astype(np.float32), normals, rows.astype(np.int32), (0.95, 0.92, 0.8))


def _room() -> list[Surface]:
    """A dark wall and what stands before it."""
    x, y, z = 3.0, 2.0, -1.5
    wall = np.array([[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]], np.float32)
    ahead = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    found = [Surface(wall, ahead, np.array([[0, 1, 2], [0, 2, 3]], np.int32), (0.10, 0.105, 0.12))]
    for row, box in enumerate(BOXES):
        points, rows = box_faces(*box)
        across = np.cross(points[1::4] - points[::4], points[2::4] - points[::4])
        normals = np.repeat(across / np.linalg.norm(across, axis=1, keepdims=True), 4, axis=0).astype(np.float32)
        share = 0.6 + 0.7 * float(rand(row, 5))
        found.append(Surface(points, normals, rows, (0.20 * share, 0.16 * share, 0.12 * share)))
    return found


def box_faces(low: tuple[float, ...], high: tuple[float, ...]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points of the six sides of a box, four each, and its triangles."""
    unit = np.array([[a, b, c] for c in (0, 1) for b in (0, 1) for a in (0, 1)], np.float64)
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    corners = np.array(low) + unit * (np.array(high) - np.array(low))
    points = np.concatenate([corners[list(face)] for face in faces]).astype(np.float32)
    quads = 4 * np.arange(6)[:, None]
    rows = np.concatenate([quads + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    return points, rows.astype(np.int32)


def _grain(picture: NDArray[np.uint8], seed: int) -> NDArray[np.uint8]:
    keys = np.arange(picture.size, dtype=np.uint32)
    sum_of_four = sum(rand(keys, 4 * seed + k) for k in range(4)) - 2.0
    noise = GRAIN * np.sqrt(3.0) * sum_of_four.reshape(picture.shape)
    return np.asarray(np.clip(np.rint(picture + noise), 0, 255), np.uint8)


def pixels_of(moment: Moment, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """(N, 2) where points of the world are seen."""
    matrix = np.linalg.inv(moment.camera)
    there = points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.asarray(FOCAL * there[:, :2] / -there[:, 2:] * [1.0, -1.0] + 0.5 * (np.array(SIZE) - 1.0))


def seen_marks(model: Figure, moment: Moment) -> dict[str, NDArray[np.float64]]:
    """Pixels of the marks a person would track from this frame: in the picture, not hidden, not seen from the side."""
    points, eye = figure_points(model, moment), moment.camera[:3, 3]
    names, places = list(room_marks()), list(room_marks().values())
    facing = np.ones(len(names))
    normals = mesh_normals(model.mesh, points)
    for part in (model.head, model.neck, model.body):
        rows = list(part.vertices.values())
        names += list(part.vertices)
        places += list(points[rows].astype(np.float64))
        way = eye - points[rows]
        cosine = (normals[rows] * way).sum(axis=1) / np.linalg.norm(way, axis=1)
        facing = np.concatenate([facing, cosine])
    triangles, corners = [triangulate(model.mesh).vertices], [points]
    for box in BOXES:
        more, rows_of_box = box_faces(*box)
        triangles.append(rows_of_box + sum(map(len, corners)))
        corners.append(more)
    tree = build_bvh(np.concatenate(corners), np.concatenate(triangles).astype(np.int32))
    ends = np.array(places)
    near = ends + (eye - ends) * (2.0 * ROOM_MARK / np.linalg.norm(eye - ends, axis=1, keepdims=True))
    hidden = hit_segments(tree, np.tile(eye, (len(ends), 1)).astype(np.float32), near.astype(np.float32))
    xy = pixels_of(moment, ends)
    inside = (xy > EDGE).all(axis=1) & (xy < np.array(SIZE) - EDGE).all(axis=1)
    return {name: xy[k] for k, name in enumerate(names) if inside[k] and not hidden[k] and facing[k] > FACING}


def write_picture(path: Path, picture: NDArray[np.uint8], quality: int | None = None) -> None:
    """Write (H, W, 3) uint8 as the suffix says."""
    coded = cv2.imencode(path.suffix, picture[:, :, ::-1], [] if quality is None else [
        cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    with atomic_write(path) as beside:
        beside.write_bytes(coded.tobytes())
