"""The camera of a single photograph from edges drawn along the axes of the world: rotation, focal length, place.

Edges that are parallel in the world meet in a vanishing point; two of them, of directions that are square to each
other, tell the focal length too (Caprile and Torre, "Using Vanishing Points for Camera Calibration", 1990). Here all
edges are met at once: each spans a plane with the centre of the camera that its direction must lie in.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.photomodel.records import Photo, Photomodel, find
from core.match.photomodel.rows import lens_of
from core.match.solve.state import FOCAL, Array, bearings

HEIGHT = 1.6  # metres of the eye above the ground, until somebody says another
FAR = 20.0  # heights of the eye: the farthest an origin is put that is not seen below the horizon
STARTS = (0.5, 0.8, 1.2, 2.0, 3.5)  # of the longer side: focal lengths from which it is looked for
VAGUE = 0.25  # of the focal length: by how much a pixel at the ends of edges may change it
FLAT = (
    "These edges tell no focal length, because those of an axis do not converge in the picture: draw some that lead "
    "into it, or set the focal length in the panel Plates."
)


class Edges(NamedTuple):
    """axis : (N,) 0, 1 or 2. ends : (N, 2, 2) pixels, from and to."""

    axis: np.ndarray
    ends: Array


def edges_of(model: Photomodel, photo: Photo) -> Edges:
    """What is known to lie along an axis and is picked at both ends in a photograph."""
    axis: list[int] = []
    ends: list[Array] = []
    for known in model.known:
        if known.kind == "axis":
            picks = [model.points[find(model.points, id_)].picks for id_ in known.points]
            at = [np.flatnonzero(one.photo == photo.id) for one in picks]
            if all(len(rows) for rows in at):
                axis.append(int(np.argmax(np.abs(known.value))))
                ends.append(np.array([one.xy[rows[0]] for one, rows in zip(picks, at, strict=True)]))
    return Edges(np.array(axis, np.int64), np.array(ends, np.float64).reshape(-1, 2, 2))


def tells(edges: Edges, *, focal: bool) -> bool:
    """True when edges tell the rotation, and with `focal` that too: how many along each axis are enough."""
    counts = np.sort(np.bincount(edges.axis, minlength=3))[::-1]
    return bool(counts[0] >= 2 and counts[1] >= (2 if focal else 1))


def lined_up(model: Photomodel, height: float | None = None) -> Photomodel:
    """The model whose one photograph with edges along axes has its camera from them; as it is where there are too few.

    height : of the camera above the ground, in metres; None for what it was. The origin of the model's frame, or the
    first end of the first edge, is at the origin of the world.

    Raises
    ------
    UserError
        The focal length is looked for, and the edges of an axis are parallel in the picture.
    """
    held = [photo for photo in model.photos if photo.rotation is not None]
    for photo in model.photos:
        edges = edges_of(model, photo)
        free = photo.focal_px is None or photo.find_focal
        if not tells(edges, focal=free) or any(other.id != photo.id for other in held):
            continue
        found = _camera(photo, edges, free=free)
        if height is None:
            height = HEIGHT
            if photo.rotation is not None and photo.translation is not None:
                height = float(-(photo.rotation.T @ np.array(photo.translation))[1])
        found = _placed(found, _origin(model, photo, edges), height)
        return model.replace(photos=tuple(found if one.id == photo.id else one for one in model.photos))
    return model


def _camera(photo: Photo, edges: Edges, *, free: bool) -> Photo:
    """The photograph with the rotation and the focal length that its edges tell."""
    from scipy.optimize import least_squares  # an empty window does without

    size = float(max(photo.width, photo.height))
    lens = lens_of(photo)
    known = float(photo.focal_px or size)

    def planes(focal: float) -> Array:
        lens[FOCAL] = np.log(focal)
        rays = bearings(lens, 0.0, edges.ends.reshape(-1, 2)).reshape(-1, 2, 3)
        normal = np.cross(rays[:, 0], rays[:, 1])
        return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12))

    # a pixel off at the end of a short edge turns it more than at that of a long one
    weight = np.linalg.norm(edges.ends[:, 1] - edges.ends[:, 0], axis=1) / size

    def off(numbers: Array) -> Array:
        focal = known * np.exp(numbers[3]) if free else known
        turn = Rotation.from_rotvec(numbers[:3]).as_matrix()
        return np.asarray(weight * np.einsum("ij,ij->i", planes(focal), turn[:, edges.axis].T))

    best = None
    for start in [share * size for share in STARTS] if free else [known]:
        first = np.append(Rotation.from_matrix(_turn(edges, planes(start))).as_rotvec(), np.log(start / known))
        done = least_squares(off, first[: 4 if free else 3], xtol=1e-12, ftol=1e-12)
        if best is None or done.cost < best.cost:
            best = done
    assert best is not None
    focal = float(known * np.exp(best.x[3])) if free else known
    if free:
        # what an error of a pixel at the end of an edge does to its row is about 1 over the size, by its weight
        values, ways = np.linalg.eigh(best.jac.T @ best.jac)
        if np.linalg.norm(ways[3] / np.sqrt(np.maximum(values, 1e-30))) / size > VAGUE:
            raise UserError(FLAT)
    turn = Rotation.from_rotvec(best.x[:3]).as_matrix()
    lens[FOCAL] = np.log(focal)
    return photo.replace(
        rotation=_signed(turn, edges, bearings(lens, 0.0, edges.ends.reshape(-1, 2)).reshape(-1, 2, 3)),
        translation=(0.0, 0.0, 0.0), focal_px=focal, find_focal=free)


def _turn(edges: Edges, normals: Array) -> Array:
    """A rotation (3, 3) whose columns lie nearly in the planes of the edges of their axes."""
    counts = np.bincount(edges.axis, minlength=3)
    first, second = np.argsort(-counts, kind="stable")[:2]
    a = np.linalg.svd(normals[edges.axis == first])[2][-1]
    across = np.vstack([normals[edges.axis == second], 1e3 * a])
    b = np.linalg.svd(across)[2][-1]
    b = b - (b @ a) * a
    turn = np.zeros((3, 3))
    turn[:, first], turn[:, second] = a, b / np.linalg.norm(b)
    third = 3 - first - second
    turn[:, third] = np.cross(turn[:, (third + 1) % 3], turn[:, (third + 2) % 3])
    return turn


def _signed(turn: Array, edges: Edges, rays: Array) -> Array:
    """The rotation with y up, and x (without edges along x, z) leading the way that its edges were drawn."""
    turn = turn.copy()
    if turn[1, 1] > 0.0:  # y of a photograph points down
        turn[:, 1] *= -1.0
    axis = 0 if (edges.axis == 0).any() else 2
    own = rays[edges.axis == axis] / rays[edges.axis == axis][..., 2:]
    way = turn[:2, axis] - own[:, 0, :2] * turn[2, axis]
    if ((own[:, 1, :2] - own[:, 0, :2]) * way).sum() < 0.0:
        turn[:, axis] *= -1.0
    other = 2 - axis
    turn[:, other] = np.cross(turn[:, (other + 1) % 3], turn[:, (other + 2) % 3])
    return turn


def _origin(model: Photomodel, photo: Photo, edges: Edges) -> Array:
    """The pixel (2,) that shows the origin."""
    if model.frame.origin is not None:
        picks = model.points[find(model.points, model.frame.origin)].picks
        at = np.flatnonzero(picks.photo == photo.id)
        if len(at):
            return np.asarray(picks.xy[at[0]])
    return np.asarray(edges.ends[0, 0])


def _placed(photo: Photo, origin: Array, height: float) -> Photo:
    """The photograph so high above the ground that an origin is seen on it."""
    assert photo.rotation is not None
    ray = bearings(lens_of(photo), 0.0, origin[None])[0]
    ray = ray / np.linalg.norm(ray)
    down = float(-(photo.rotation.T @ ray)[1])
    depth = height / down if down > 1.0 / FAR else FAR * height
    return photo.replace(translation=tuple(map(float, depth * ray)))
