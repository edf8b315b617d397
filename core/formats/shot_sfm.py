"""Cameras and points as Bundler and OpenSfM have them, both ways.

Bundler: ``bundle.out``, y up, looking along -z, places in the picture from its middle. OpenSfM:
``reconstruction.json``, coordinates over the longer side of the picture.
"""

from __future__ import annotations

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.formats.shot_models import frame_of, picture_name, shot_of_images
from core.match.lens import coefficients, model_of, start_lens
from core.match.solve.shot import FLIP, Shot

OPENSFM = "reconstruction.json"


def bundler_text(shot: Shot) -> str:
    """A bundle: cameras in the order of their frames, and points with who saw them.

    Raises
    ------
    UserError
        The lens is not one Bundler has: its centre in the middle, pixels square, bent by two numbers.
    """
    lens = shot.lens
    if model_of(lens).name != "brown" or max(map(abs, shot.off_centre)) > 0.01 or abs(shot.stretch - 1.0) > 1e-6:
        raise UserError("Bundler has only lenses of k1 and k2 whose centre is the middle; write cameras.txt instead.")
    lines = ["# Bundle file v0.3", f"{len(shot.frames)} {len(shot.points)}"]

    def add(*numbers: float) -> None:
        lines.append(" ".join(f"{value:.15g}" for value in numbers))

    for focal, turn, shift in zip(shot.focal, shot.rotation, shot.translation, strict=True):
        add(focal, lens[1], lens[2])
        for row in FLIP @ turn:
            add(*row)
        add(*(FLIP @ shift))
    views: list[list[str]] = [[] for _ in shot.points]
    if shot.seen is not None:
        middle = 0.5 * (np.array(shot.size) - 1.0)
        for frame, point, xy in zip(*shot.seen, strict=True):
            x, y = (xy - middle) * [1.0, -1.0]
            views[point].append(f"{frame} {point} {x:.9g} {y:.9g}")
    for place, seen in zip(shot.points, views, strict=True):
        add(*place)
        lines += ["128 128 128", " ".join([str(len(seen)), *seen])]
    return "\n".join(lines) + "\n"


def opensfm_text(shot: Shot) -> str:
    """One reconstruction.

    Raises
    ------
    UserError
        OpenSfM has no such lens.
    """
    lens, long = shot.lens, float(max(shot.size))
    kind = {"brown": "brown", "brown5": "brown", "fisheye": "fisheye_opencv"}.get(model_of(lens).name)
    if kind is None:
        raise UserError(f"OpenSfM has no lens of the model {model_of(lens).name}; undistort the plate first.")
    bend = ({"p1": 0.0, "p2": 0.0, "k3": 0.0} if kind == "brown" else {}) | coefficients(lens)
    right, below = shot.off_centre
    cameras = {
        f"camera{k + 1}": {
            "projection_type": kind, "width": shot.size[0], "height": shot.size[1], "focal_x": focal / long,
            "focal_y": focal * shot.stretch / long, "c_x": right / long, "c_y": below / long, **bend,
        } for k, focal in enumerate((shot.focal if shot.zooms else shot.focal[:1]).tolist())
    }
    turns = Rotation.from_matrix(shot.rotation).as_rotvec()
    shots = {
        picture_name(frame): {
            "camera": f"camera{k + 1 if shot.zooms else 1}", "rotation": turns[k].tolist(),
            "translation": shot.translation[k].tolist(),
        } for k, frame in enumerate(shot.frames)
    }
    points = {
        str(k): {"coordinates": place, "color": [128, 128, 128]} for k, place in enumerate(shot.points.tolist())}
    return msgspec.json.encode([{"cameras": cameras, "shots": shots, "points": points}]).decode()


def read_bundler(text: str, size: tuple[int, int], name: str) -> Shot:
    """Cameras of a ``bundle.out`` that were found (a focal length above 0), and its points."""
    try:
        numbers = [line for line in text.splitlines() if not line.startswith("#")]
        words = iter(" ".join(numbers).split())
        count, many = int(next(words)), int(next(words))
        if not (0 <= count < 1_000_000 and 0 <= many < 50_000_000):
            raise ValueError
        images = []
        for k in range(count):
            values = np.array([float(next(words)) for _ in range(15)])
            if values[0] > 0.0:
                lens = start_lens(float(values[0]), *size)
                lens[1:3] = values[1:3]
                images.append((k + 1, FLIP @ values[3:12].reshape(3, 3), FLIP @ values[12:15], lens, size))
        points = np.zeros((many, 3))
        for k in range(many):
            points[k] = [float(next(words)) for _ in range(3)]
            for _ in range(3):
                next(words)
            for _ in range(4 * int(next(words))):
                next(words)
    except (StopIteration, ValueError, RuntimeError):
        raise UserError(f"{name} is no bundle of Bundler, or it is cut.") from None
    return shot_of_images(images, points, name)


def read_opensfm(data: bytes, name: str) -> Shot:
    """The first reconstruction of OpenSfM."""
    try:
        found = msgspec.json.decode(data)[0]
        images = []
        for k, (image, shot) in enumerate(found["shots"].items()):
            camera = found["cameras"][shot["camera"]]
            kind = camera["projection_type"]
            if kind not in ("perspective", "brown", "fisheye_opencv", "perspective_opencv"):
                raise UserError(f"{name}: cameras of the kind {str(kind)[:40]} are not read.")
            size = (int(camera["width"]), int(camera["height"]))
            long = float(max(size))
            focal = float(camera["focal"] if "focal" in camera else camera["focal_x"])
            more = any(camera.get(key, 0.0) for key in ("p1", "p2", "k3"))
            model = "fisheye" if kind == "fisheye_opencv" else "brown5" if more else "brown"
            lens = start_lens(focal * long, *size, model)
            lens[3] = np.log(float(camera.get("focal_y", focal)) / focal)
            lens[4:6] += long * np.array([camera.get("c_x", 0.0), camera.get("c_y", 0.0)])
            lens[[1, 2, *range(6, len(lens))]] = [camera.get(key, 0.0) for key in coefficients(lens)]
            turn = Rotation.from_rotvec(np.array(shot["rotation"], np.float64)).as_matrix()
            images.append((frame_of(image, k), turn, np.array(shot["translation"], np.float64), lens, size))
        points = np.array([point["coordinates"] for point in found["points"].values()], np.float64).reshape(-1, 3)
    except (msgspec.DecodeError, KeyError, TypeError, ValueError, IndexError, AttributeError, RecursionError):
        raise UserError(f"{name} is no reconstruction of OpenSfM.") from None
    return shot_of_images(images, points, name)
