"""What is built upon the points of a model: polygons, boxes, extrusions, lathes, mirror images, bridges, as one mesh.

Parts name points, not places, so the mesh follows when the points are solved again.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.photomodel.records import Part, Photomodel
from core.match.solve.state import Array
from core.mesh.mesh import Mesh
from core.record import freeze

SEGMENTS, MOST_SEGMENTS = 24, 1024  # of a lathe
ON = 1e-6  # of the size: so near the mirror a vertex is its own image

Key = tuple[int, int]  # (0, id of a point), or (id of a part + 1, number)


class _Piece(NamedTuple):
    """faces : of keys, counter-clockwise from outside. outline : a closed loop of keys that bridges start from."""

    faces: list[list[Key]]
    outline: list[Key]


class Builder:
    """Parts of a model one after another."""

    def __init__(self, model: Photomodel) -> None:
        self.places: dict[Key, Array] = {
            (0, point.id): np.array(point.place) for point in model.points if point.place is not None
        }
        there = np.array(list(self.places.values())).reshape(-1, 3)
        self.size = (float(np.ptp(there, axis=0).max()) if len(there) else 0.0) or 1.0
        self.pieces: dict[int, _Piece] = {}
        for part in model.parts:
            self.pieces[part.id] = getattr(self, f"_{part.kind}")(part)

    def _at(self, part: Part, ids: tuple[int, ...]) -> list[Key]:
        keys = [(0, id_) for id_ in ids]
        if any(key not in self.places for key in keys):
            raise UserError(f"{part.name} is built on a point that has no place yet; solve the model first.")
        return keys

    def _new(self, part: Part, places: Array) -> list[Key]:
        taken = sum(key[0] == part.id + 1 for key in self.places)
        keys = [(part.id + 1, taken + k) for k in range(len(places))]
        self.places.update(zip(keys, places, strict=True))
        return keys

    def _xyz(self, keys: list[Key]) -> Array:
        return np.array([self.places[key] for key in keys])

    def _polygon(self, part: Part) -> _Piece:
        loop = self._at(part, part.points)
        if len(loop) < 3:
            raise UserError(f"{part.name} needs three points or more.")
        return _Piece([loop], loop)

    def _box(self, part: Part) -> _Piece:
        """From a corner and the ends of two edges; the third edge ends at a point, or is a height along the normal."""
        if len(part.points) not in (3, 4) or (len(part.points) == 3) != (len(part.value) == 1):
            raise UserError(f"{part.name} needs a corner and the ends of its three edges, or two of them and a height.")
        keys = self._at(part, part.points)
        corner, u, v = (self.places[key] for key in keys[:3])
        u, v = u - corner, v - corner
        if len(keys) == 4:
            w = self.places[keys[3]] - corner
        else:
            w = part.value[0] * _normal(np.stack([corner, corner + u, corner + v]), part.name)
        (far,) = self._new(part, (corner + u + v)[None])
        base = [keys[0], keys[1], far, keys[2]]
        top = self._new(part, np.stack([corner + w, corner + u + w, corner + u + v + w, corner + v + w]))
        if len(keys) == 4:
            top[0] = keys[3]
        return _Piece(_closed(base, top, outwards=float(np.cross(u, v) @ w)), top)

    def _extrude(self, part: Part) -> _Piece:
        """A loop of points, or the outline of a part, along its normal."""
        if len(part.value) != 1 or bool(part.points) == bool(part.parts) or len(part.parts) > 1:
            raise UserError(f"{part.name} needs a loop of points or one part, and a height.")
        base = self.pieces[part.parts[0]].outline if part.parts else self._at(part, part.points)
        places = self._xyz(base)
        top = self._new(part, places + part.value[0] * _normal(places, part.name))
        faces = _closed(base, top, outwards=part.value[0])
        return _Piece(faces[1:] if part.parts else faces, top)  # the part's own face closes the bottom

    def _lathe(self, part: Part) -> _Piece:
        keys = self._at(part, part.points)
        segments = int(part.value[0]) if part.value else SEGMENTS
        if len(keys) < 4 or not 3 <= segments <= MOST_SEGMENTS:
            raise UserError(f"{part.name} needs two points of an axis, two of a profile, and 3 to 1024 segments.")
        (a, b), profile = self._xyz(keys[:2]), self._xyz(keys[2:])
        if np.linalg.norm(b - a) < ON * self.size:
            raise UserError(f"The axis of {part.name} has no length.")
        axis = (b - a) / np.linalg.norm(b - a)
        middle = a + ((profile - a) @ axis)[:, None] * axis
        spoke = profile - middle
        side = np.cross(axis, spoke)
        rings: list[list[Key]] = []
        for k, key in enumerate(keys[2:]):
            if np.linalg.norm(spoke[k]) < ON * self.size:
                rings.append([key] * segments)
                continue
            angle = np.arange(1, segments)[:, None] * (2.0 * np.pi / segments)
            rings.append([key, *self._new(part, middle[k] + np.cos(angle) * spoke[k] + np.sin(angle) * side[k])])
        faces = []
        for low, high in pairwise(rings):
            for k in range(segments):
                n = (k + 1) % segments
                loop = list(dict.fromkeys([low[k], low[n], high[n], high[k]]))
                if len(loop) > 2:
                    faces.append(loop)
        if (middle[-1] - middle[0]) @ axis < 0.0:
            faces = [face[::-1] for face in faces]
        return _Piece(faces, rings[-1])

    def _mirror(self, part: Part) -> _Piece:
        """In the plane of three points, or in the one between two."""
        if not part.parts or len(part.points) not in (2, 3):
            raise UserError(f"{part.name} needs parts, and three points of a plane or two that mirror each other.")
        places = self._xyz(self._at(part, part.points))
        if len(places) == 2:
            middle, normal = places.mean(axis=0), places[1] - places[0]
            normal = normal / max(float(np.linalg.norm(normal)), 1e-30)
        else:
            middle, normal = places[0], _normal(places, part.name)
        image: dict[Key, Key] = {}
        faces, outline = [], []
        for id_ in part.parts:
            piece = self.pieces[id_]
            for key in dict.fromkeys([key for face in piece.faces for key in face] + piece.outline):
                height = float((self.places[key] - middle) @ normal)
                if abs(height) < ON * self.size:
                    image[key] = key
                elif key not in image:
                    (image[key],) = self._new(part, (self.places[key] - 2.0 * height * normal)[None])
            faces += [[image[key] for key in face[::-1]] for face in piece.faces]
            outline = [image[key] for key in piece.outline[::-1]]
        return _Piece(faces, outline)

    def _bridge(self, part: Part) -> _Piece:
        if len(part.parts) != 2:
            raise UserError(f"{part.name} needs two parts to go between.")
        a, b = (list(self.pieces[id_].outline) for id_ in part.parts)
        if len(a) != len(b):
            raise UserError(f"{part.name} cannot go between outlines of {len(a)} and {len(b)} points; make them alike.")
        places, there = self._xyz(a), self._xyz(b)
        turns = [np.roll(there[::way], -k, axis=0) for way in (1, -1) for k in range(len(b))]
        best = int(np.argmin([float(((turned - places) ** 2).sum()) for turned in turns]))
        way, k = (1, best) if best < len(b) else (-1, best - len(b))
        b = b[::way]
        b = b[k:] + b[:k]
        count = len(a)
        return _Piece([[a[k], b[k], b[(k + 1) % count], a[(k + 1) % count]] for k in range(count)], b)


def built(model: Photomodel) -> Mesh:
    """The parts that are not hidden as one mesh of one part each, without UVs.

    Raises
    ------
    UserError
        A part cannot be made from its points; the message says what it needs.
    """
    builder = Builder(model)
    shown = [part for part in model.parts if not part.hidden]
    faces = [(row, face) for row, part in enumerate(shown) for face in builder.pieces[part.id].faces]
    if not faces:
        raise UserError(f"Nothing is built in {model.name} yet; make a polygon or a box of its points.")
    used = list(dict.fromkeys(key for _, face in faces for key in face))
    number = {key: k for k, key in enumerate(used)}
    return Mesh(
        points=freeze(builder._xyz(used).astype(np.float32)),
        counts=freeze(np.array([len(face) for _, face in faces], np.int32)),
        corners=freeze(np.array([number[key] for _, face in faces for key in face], np.int32)),
        parts=freeze(np.array([row for row, _ in faces], np.int32)),
        part_names=tuple(part.name for part in shown),
    )


def _normal(places: Array, name: str) -> Array:
    """Unit normal of a loop (N, 3), by its area (Newell's method)."""
    normal = np.cross(places, np.roll(places, -1, axis=0)).sum(axis=0)
    length = float(np.linalg.norm(normal))
    if length < 1e-12 * max(1.0, float(np.abs(places).max()) ** 2):
        raise UserError(f"The points of {name} lie on one line.")
    return np.asarray(normal / length)


def _closed(base: list[Key], top: list[Key], outwards: float) -> list[list[Key]]:
    """Bottom, top and sides between two loops, seen counter-clockwise from outside when `outwards` is positive."""
    count = len(base)
    faces = [base[::-1], list(top)]
    faces += [[base[k], base[(k + 1) % count], top[(k + 1) % count], top[k]] for k in range(count)]
    return faces if outwards > 0.0 else [face[::-1] for face in faces]
