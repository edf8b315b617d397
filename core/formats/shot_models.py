"""Cameras, points and who saw them as COLMAP has them: cameras, images and points3D, `.txt` or `.bin`.

The name of its file of cameras stands for the three. Its pixels begin at the corner, ours at the centre.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.formats.atomic import atomic_write
from core.match.lens import model_of, start_lens
from core.match.solve.shot import Shot
from core.match.solve.state import Array

LARGEST = 1 << 30
# number, how many parameters, whether fx and fy are apart, which columns of our lens follow the centre
MODELS = {
    "SIMPLE_PINHOLE": (0, 3, False, ()), "PINHOLE": (1, 4, True, ()), "SIMPLE_RADIAL": (2, 4, False, (1,)),
    "RADIAL": (3, 5, False, (1, 2)), "OPENCV": (4, 8, True, (1, 2, 6, 7)), "OPENCV_FISHEYE": (5, 8, True, (1, 2, 6, 7)),
}  # fmt: skip
NAMES = {number: name for name, (number, *_) in MODELS.items()}


def write_colmap(path: Path, shot: Shot) -> None:
    """Write cameras, images and points3D beside each other; `path` is that of the cameras, .txt or .bin.

    Raises
    ------
    UserError
        COLMAP has no such lens, or a file could not be written.
    """
    kind = model_of(shot.lens).name
    model = {"brown": "OPENCV", "brown5": "OPENCV", "fisheye": "OPENCV_FISHEYE"}.get(kind)
    if model is None or (kind == "brown5" and shot.lens[8] != 0.0):
        with_what = " with a k3" if model else ""
        raise UserError(f"COLMAP has no lens of the model {kind}{with_what}; undistort the plate first.")
    lens, stretch = shot.lens, shot.stretch
    rest = [*lens[4:6] + 0.5, *lens[1:3], *((0.0, 0.0) if kind == "brown" else lens[6:8])]
    cameras = [(k + 1, [f, f * stretch, *rest]) for k, f in enumerate(shot.focal if shot.zooms else shot.focal[:1])]
    turns = Rotation.from_matrix(shot.rotation).as_quat()[:, [3, 0, 1, 2]]
    images = [
        (k + 1, [*turns[k], *shot.translation[k]], k + 1 if shot.zooms else 1, picture_name(frame))
        for k, frame in enumerate(shot.frames)
    ]
    sights = _Sights(shot)
    binary = path.suffix.lower() == ".bin"
    parts = (_binary if binary else _text)(MODELS[model][0], model, shot, cameras, images, sights)
    for part, data in zip(("cameras", "images", "points3D"), parts, strict=True):
        with atomic_write(path.with_name(part + path.suffix)) as beside:
            beside.write_bytes(data)


class _Sights:
    """Who saw what, numbered as COLMAP does: the places of an image in the order of their points."""

    def __init__(self, shot: Shot) -> None:
        self.of_image: list[list[tuple[float, float, int]]] = [[] for _ in shot.frames]
        self.of_point: list[list[int]] = [[] for _ in shot.points]
        if shot.seen is not None:
            for frame, point, (x, y) in zip(*(part.tolist() for part in shot.seen), strict=True):
                self.of_point[point] += [frame + 1, len(self.of_image[frame])]
                self.of_image[frame].append((x + 0.5, y + 0.5, point + 1))


def _text(
    number: int, model: str, shot: Shot, cameras: list[Any], images: list[Any], sights: _Sights
) -> tuple[bytes, ...]:
    def words(numbers: Any) -> str:
        return " ".join(f"{float(v):.15g}" for v in numbers)

    width, height = shot.size
    first = "".join(f"{key} {model} {width} {height} {words(values)}\n" for key, values in cameras)
    second = "".join(
        f"{key} {words(pose)} {camera} {name}\n" + " ".join(f"{x:.9g} {y:.9g} {point}" for x, y, point in seen) + "\n"
        for (key, pose, camera, name), seen in zip(images, sights.of_image, strict=True))
    third = "".join(
        f"{k + 1} {words(place)} 128 128 128 0 {' '.join(map(str, seen))}\n"
        for k, (place, seen) in enumerate(zip(shot.points, sights.of_point, strict=True)))
    return tuple(part.encode() for part in (first, second, third))


def _binary(
    number: int, model: str, shot: Shot, cameras: list[Any], images: list[Any], sights: _Sights
) -> tuple[bytes, ...]:
    first = struct.pack("<Q", len(cameras)) + b"".join(
        struct.pack(f"<IiQQ{len(values)}d", key, number, *shot.size, *values) for key, values in cameras)
    second = struct.pack("<Q", len(images)) + b"".join(
        struct.pack("<I7dI", key, *pose, camera) + name.encode() + b"\0" + struct.pack("<Q", len(seen))
        + b"".join(struct.pack("<2dQ", *one) for one in seen)
        for (key, pose, camera, name), seen in zip(images, sights.of_image, strict=True))
    third = struct.pack("<Q", len(shot.points)) + b"".join(
        struct.pack("<Q3d3BdQ", k + 1, *place, 128, 128, 128, 0.0, len(seen) // 2)
        + struct.pack(f"<{len(seen)}I", *seen)
        for k, (place, seen) in enumerate(zip(shot.points, sights.of_point, strict=True)))
    return first, second, third


def read_colmap(path: Path) -> Shot:
    """Images, in the order of the numbers in their names, with the points.

    Raises
    ------
    UserError
        A file is missing, cut or damaged, or its cameras differ in more than their focal length.
    """
    binary = path.suffix.lower() == ".bin"
    data = []
    for part in ("cameras", "images", "points3D"):
        file = path.with_name(part + path.suffix)
        if not file.is_file():
            raise UserError(f"{file.name} is missing beside {path.name}; COLMAP's model is three files.")
        if file.stat().st_size > LARGEST:
            raise UserError(f"{file.name} is larger than {LARGEST >> 30} GB.")
        data.append(file.read_bytes())
    try:
        cameras = (_cameras_of_binary if binary else _cameras_of_text)(data[0])
        images = (_images_of_binary if binary else _images_of_text)(data[1])
        points = (_points_of_binary if binary else _points_of_text)(data[2])
        lenses = {key: _lens(model, size, values) for key, (model, size, values) in cameras.items()}
        found = []
        for k, (pose, camera, name) in enumerate(images):
            turn = Rotation.from_quat(np.array(pose)[[1, 2, 3, 0]]).as_matrix()
            found.append((frame_of(name, k), turn, np.array(pose[4:]), lenses[camera], cameras[camera][1]))
        return shot_of_images(found, points, path.name)
    except (struct.error, ValueError, KeyError, IndexError, OverflowError, UnicodeDecodeError):
        raise UserError(f"{path.name}: COLMAP's model is cut or damaged.") from None


def _cameras_of_text(data: bytes) -> dict[int, tuple[str, tuple[int, int], list[float]]]:
    found = {}
    for line in _lines(data):
        key, model, width, height, *values = line.split()
        found[int(key)] = (model, (int(width), int(height)), [float(v) for v in values])
    return found


def _images_of_text(data: bytes) -> list[tuple[list[float], int, str]]:
    lines = [line for line in data.decode().split("\n") if not line.startswith("#")]
    found = []
    for line in lines[::2]:
        if line.strip():
            words = line.split(maxsplit=9)
            found.append(([float(v) for v in words[1:8]], int(words[8]), words[9].strip()))
    return found


def _points_of_text(data: bytes) -> Array:
    return np.array([[float(v) for v in line.split()[1:4]] for line in _lines(data)], np.float64).reshape(-1, 3)


def _lines(data: bytes) -> list[str]:
    return [line for line in data.decode().splitlines() if line.strip() and not line.startswith("#")]


def _cameras_of_binary(data: bytes) -> dict[int, tuple[str, tuple[int, int], list[float]]]:
    (count,), at, found = struct.unpack_from("<Q", data), 8, {}
    for _ in range(count):
        key, number, width, height = struct.unpack_from("<IiQQ", data, at)
        model = NAMES[number]
        size = MODELS[model][1]
        found[key] = (model, (width, height), list(struct.unpack_from(f"<{size}d", data, at + 24)))
        at += 24 + 8 * size
    return found


def _images_of_binary(data: bytes) -> list[tuple[list[float], int, str]]:
    (count,), at, found = struct.unpack_from("<Q", data), 8, []
    for _ in range(count):
        _, *pose, camera = struct.unpack_from("<I7dI", data, at)
        end = data.index(b"\0", at + 64)
        found.append((pose, camera, data[at + 64 : end].decode()))
        (seen,) = struct.unpack_from("<Q", data, end + 1)
        at = end + 9 + 24 * seen
    return found


def _points_of_binary(data: bytes) -> Array:
    (count,), at, found = struct.unpack_from("<Q", data), 8, []
    for _ in range(count):
        found.append(struct.unpack_from("<3d", data, at + 8))
        (seen,) = struct.unpack_from("<Q", data, at + 43)
        at += 51 + 8 * seen
    return np.array(found, np.float64).reshape(-1, 3)


def _lens(model: str, size: tuple[int, int], values: list[float]) -> Array:
    if model not in MODELS:
        raise UserError(f"Cameras of the model {model[:40]} are not read; there are {', '.join(MODELS)}.")
    _, count, apart, columns = MODELS[model]
    if len(values) != count or not np.isfinite(values).all() or min(size) < 1 or values[0] <= 0:
        raise ValueError
    kind = {"OPENCV": "brown5", "OPENCV_FISHEYE": "fisheye"}.get(model, "brown")
    if model == "OPENCV" and not any(values[6:8]):
        kind, columns = "brown", columns[:2]
    lens = start_lens(values[0], *size, kind)
    if apart:
        lens[3] = np.log(values[1] / values[0])
    after = 2 if apart else 1
    lens[4:6] = np.array(values[after : after + 2]) - 0.5
    lens[list(columns)] = values[after + 2 : after + 2 + len(columns)]
    return lens


def picture_name(frame: int) -> str:
    """What a frame of the plate is called where only pictures are known."""
    return f"frame.{frame:04d}.png"


def frame_of(name: str, row: int) -> int:
    numbers = re.findall(r"\d+", Path(name).stem)
    return int(numbers[-1]) if numbers and len(numbers[-1]) < 9 else row + 1


def shot_of_images(images: list[tuple[int, Array, Array, Array, tuple[int, int]]], points: Array, name: str) -> Shot:
    """A shot of (frame, rotation, translation, lens, size), which must share their lens but for the focal length."""
    if not images:
        raise UserError(f"{name} holds no cameras.")
    frames = [image[0] for image in images]
    if len(set(frames)) < len(frames):
        images = [(k + 1, *image[1:]) for k, image in enumerate(images)]
    images = sorted(images, key=lambda image: image[0])
    lens, size = images[0][3], images[0][4]
    for _, _, _, other, its in images:
        if its != size or len(other) != len(lens) or np.abs(other[1:] - lens[1:]).max() > 1e-9:
            raise UserError(f"{name} holds cameras of several lenses or sizes; a shot is of one.")
    rotation, translation = (np.array([image[k] for image in images], np.float64) for k in (1, 2))
    if not (np.isfinite(rotation).all() and np.isfinite(translation).all() and np.isfinite(points).all()):
        raise UserError(f"{name} holds numbers that are not finite.")
    return Shot(
        size, np.array([image[0] for image in images], np.int32), rotation, translation,
        np.exp(np.array([image[3][0] for image in images])), lens, points,
        tuple(f"point{k + 1}" for k in range(len(points))),
    )
