"""Box modelling in code: lofted rings, extruded limbs, insets and mirrors that end in a cage of quads with UVs."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.transform import normalized

Array = NDArray[np.float64]

RING = 12  # points of a ring: 0 on top, 1 .. 5 down the side of +x, 6 at the bottom, 7 .. 11 up the other side
_ANGLES = np.radians([0.0, 30.0, 60.0, 90.0, 125.0, 155.0, 180.0])


class Face(NamedTuple):
    """One quad of the cage: its vertices outward, part, UV island, and corners (4, 2) in metres of that island."""

    vertices: tuple[int, int, int, int]
    part: str
    island: str
    uvs: Array


class Cage:
    """A mesh in the making, symmetric across x = 0. `pairs` has for each vertex the one opposite (itself on x = 0)."""

    def __init__(self) -> None:
        self.points: list[Array] = []
        self.pairs: list[int] = []
        self.faces: list[Face] = []
        self.weights: list[dict[str, float]] = []  # of joints, per vertex

    def add(self, points: ArrayLike, weights: dict[str, float]) -> list[int]:
        """Add points (N, 3) of the +x side and their opposites; returns the N of the +x side."""
        made = []
        for point in np.asarray(points, np.float64).reshape(-1, 3):
            index = len(self.points)
            made.append(index)
            self.points.append(point)
            self.weights.append(weights)
            if point[0] == 0.0:
                self.pairs.append(index)
            else:
                self.points.append(point * (-1.0, 1.0, 1.0))
                self.weights.append(weights)
                self.pairs += [index + 1, index]
        return made

    def ring(
        self, y: float, z: float, pitch: float, width: float, top: float, bottom: float, weights: dict[str, float]
    ) -> list[int]:
        """A ring of RING points about (0, y, z), in the plane across a direction `pitch` degrees above +z."""
        p = np.radians(pitch)
        up = np.array([0.0, np.cos(p), -np.sin(p)])
        height = np.where(np.cos(_ANGLES) > 0.0, top, bottom) * np.cos(_ANGLES)
        half = np.array([0.0, y, z]) + height[:, None] * up
        half[1:6, 0] = width * np.sin(_ANGLES[1:6])
        made = self.add(half, weights)
        return made + [self.pairs[i] for i in made[5:0:-1]]

    def loft(
        self, rings: list[list[int]], part: str, island: str, skip: frozenset[tuple[int, int]] = frozenset()
    ) -> Array:
        """Quads between rings, cut open along the bottom. `skip` leaves out (row, column) and its opposite.

        Returns the corners (rows, RING, 4, 2) of all quads, skipped ones included.
        """
        order = [6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 4, 5, 6]
        around = np.array([[self.points[ring[i]] for i in order] for ring in rings])
        u, v = _unrolled(around)
        corners = np.zeros((len(rings) - 1, RING, 4, 2))
        for row, (a, b) in enumerate(itertools.pairwise(rings)):
            for place, k in enumerate(order[:-1]):
                n = (k + 1) % RING
                corners[row, k] = [
                    (u[row, place], v[row]), (u[row + 1, place], v[row + 1]),
                    (u[row + 1, place + 1], v[row + 1]), (u[row, place + 1], v[row]),
                ]
                if (row, k) not in skip and (row, RING - 1 - k) not in skip:
                    self.faces.append(Face((a[k], b[k], b[n], a[n]), part, island, corners[row, k]))
        return corners

    def cap(self, ring: list[int], point: ArrayLike, weights: dict[str, float], part: str, island: str) -> None:
        """Close the front end of a loft with six quads about a point on x = 0."""
        centre = self.add(point, weights)[0]
        flat = {i: np.array([self.points[i][0], self.points[i][1] - self.points[i][2]]) for i in [centre, *ring]}
        for k in range(0, RING, 2):
            vertices = (centre, ring[(k + 2) % RING], ring[k + 1], ring[k])
            self.faces.append(Face(vertices, part, island, np.array([flat[i] for i in vertices])))

    def limb(
        self, base: list[int], sections: list[Array], weights: list[dict[str, float]], parts: list[str], island: str
    ) -> list[int]:
        """Extrude a hole's rim (+x side, counter-clockwise from outside) through sections, on both sides.

        Returns the last section, still open.
        """
        loops = [base] + [self.add(s, w) for s, w in zip(sections, weights, strict=True)]
        around = np.array([[self.points[i] for i in [*loop, loop[0]]] for loop in loops])
        u, v = _unrolled(around)
        n = len(base)
        for row, (a, b) in enumerate(itertools.pairwise(loops)):
            for k in range(n):
                j = (k + 1) % n
                uvs = np.array([
                    (u[row, k], v[row]), (u[row, k + 1], v[row]),
                    (u[row + 1, k + 1], v[row + 1]), (u[row + 1, k], v[row + 1]),
                ])
                self.both((a[k], a[j], b[j], b[k]), parts[row], island, uvs)
        return loops[-1]

    def both(self, vertices: tuple[int, int, int, int], part: str, island: str, uvs: Array) -> None:
        """Add a quad of the +x side and its opposite, whose island is another one."""
        self._pair(vertices, part, island, uvs, uvs * (-1.0, 1.0), f"{island} opposite")

    def inset(
        self, vertices: list[int], steps: list[tuple[float, float]], weights: dict[str, float], parts: list[str],
        island: str, uvs: Array, opposite_uvs: Array,
    ) -> None:
        """Fill a hole of four (both sides) with nested rings: `steps` of (fraction to the centre, metres outward).

        The last of `parts` is that of the quad in the middle. UVs nest inside those of the hole.
        """
        rim = np.array([self.points[i] for i in vertices])
        normal = normalized(np.cross(rim[2] - rim[0], rim[3] - rim[1]))
        middle = rim.mean(axis=0)
        a, uv_a = vertices, (uvs, opposite_uvs)
        for (fraction, outward), part in zip(steps, parts, strict=False):
            b = self.add(rim + (middle - rim) * fraction + normal * outward, weights)
            uv_b = tuple(hole + (hole.mean(axis=0) - hole) * fraction for hole in (uvs, opposite_uvs))
            for k in range(4):
                j = (k + 1) % 4
                nested = [np.array([old[k], old[j], new[j], new[k]]) for old, new in zip(uv_a, uv_b, strict=True)]
                self._pair((a[k], a[j], b[j], b[k]), part, island, nested[0], nested[1])
            a, uv_a = b, (uv_b[0], uv_b[1])
        self._pair((a[0], a[1], a[2], a[3]), parts[-1], island, uv_a[0], uv_a[1])

    def _pair(
        self, vertices: tuple[int, int, int, int], part: str, island: str, uvs: Array, opposite_uvs: Array,
        opposite_island: str | None = None,
    ) -> None:
        """Add a quad of the +x side and its opposite; both sets of UVs are in the order of `vertices`."""
        a, b, c, d = vertices
        self.faces.append(Face(vertices, part, island, uvs))
        opposite = (self.pairs[a], self.pairs[d], self.pairs[c], self.pairs[b])
        self.faces.append(Face(opposite, part, opposite_island or island, opposite_uvs[[0, 3, 2, 1]]))


def _unrolled(around: Array) -> tuple[Array, Array]:
    """Island coordinates of a tube (rows, points, 3): u (rows, points) about the middle, v (rows,) along it."""
    steps = np.linalg.norm(np.diff(around, axis=1), axis=2)
    u = np.concatenate([np.zeros((len(around), 1)), np.cumsum(steps, axis=1)], axis=1)
    along = np.linalg.norm(np.diff(around, axis=0), axis=2).mean(axis=1)
    return u - 0.5 * u[:, -1:], np.concatenate([[0.0], np.cumsum(along)])
