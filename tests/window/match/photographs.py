"""Photographs of a house of known measures, drawn as plain faces with dark edges, for hands that pick its corners."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from core.match.photomodel.records import Photo
from core.match.photomodel.rows import seen_by
from tests.core.match.photomodel.scenes import HOUSE, photo

SIZE, FOCAL = (1200, 800), 1040.0
PHOTOS = tuple(photo(k + 1, centre, size=SIZE, focal=FOCAL) for k, centre in enumerate(
    ((-9.5, 2.0, -4.0), (-7.0, 4.5, -7.0), (-1.5, 2.5, -10.0))))
# rows of HOUSE around each face, counter-clockwise from outside, and their colour as OpenCV has it
FACES = (
    ((0, 4, 8, 5, 1), (150, 178, 200)), ((0, 3, 7, 4), (110, 136, 160)), ((4, 7, 9, 8), (70, 76, 140)))
DOOR = np.array([[1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.8, 2.0, 0.0], [1.8, 0.0, 0.0]])


def drawn(one: Photo) -> np.ndarray:
    """(800, 1200, 3) uint8: the house in one photograph."""
    image = np.full((SIZE[1], SIZE[0], 3), (214, 200, 186), np.uint8)
    assert one.rotation is not None
    ahead, right = one.rotation[2] * [1.0, 0.0, 1.0], one.rotation[0]
    horizon = _pixels(one, 1e5 * (ahead + np.array([[-2.0], [2.0]]) * right))
    low = np.array([[SIZE[0] * 3, SIZE[1] * 3], [-SIZE[0] * 3, SIZE[1] * 3]])
    cv2.fillPoly(image, [np.concatenate([horizon, low]).astype(np.int32)], (126, 150, 148), cv2.LINE_AA)
    eye = -one.rotation.T @ np.array(one.translation)
    for rows, color in FACES:
        corners = HOUSE[list(rows)]
        normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
        if normal @ (corners[0] - eye) < 0.0:
            _face(image, one, corners, color)
    if eye[2] < 0.0:
        _face(image, one, DOOR, (60, 70, 90))
    return image


def photographed(folder: Path) -> Path:
    """Three photographs as house.1.png to house.3.png; the first of them."""
    for number, one in enumerate(PHOTOS, 1):
        cv2.imwrite(str(folder / f"house.{number}.png"), drawn(one))
    return folder / "house.1.png"


def corner(number: int, frame: int) -> np.ndarray:
    """Where a corner of the house is (2,) in a photograph."""
    return seen_by(PHOTOS[frame - 1], HOUSE[number][None])[0][0]


def _face(image: np.ndarray, one: Photo, corners: np.ndarray, color: tuple[int, int, int]) -> None:
    at = _pixels(one, corners)
    cv2.fillPoly(image, [at], color, cv2.LINE_AA)
    cv2.polylines(image, [at], True, (40, 44, 52), 2, cv2.LINE_AA)


def _pixels(one: Photo, points: np.ndarray) -> np.ndarray:
    return np.rint(seen_by(one, points)[0]).astype(np.int32)
