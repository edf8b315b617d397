"""What is known of the scene (survey, distances, planes, lines, circles, angles, symmetry) as residuals of points.

A shape nobody measured (the plane some points lie on, the circle, the mirror) is fitted to the points at every step and
projected out of the derivatives, so that a constraint is about points alone. (Variable projection: Golub and Pereyra,
"The Differentiation of Pseudo-Inverses and Nonlinear Least Squares Problems Whose Variables Separate", 1973, in the
short form of Kaufman, 1975.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.solve.state import Array

HARD = 1e-5  # of the size of the scene, or radians: how closely what is hard is held
ROUNDS = 6  # of fitting a circle or a mirror
TINY = 1e-12


class Constraint(NamedTuple):
    """kind : a key of `KINDS`. points : rows of the points. value : what was measured, empty where nothing was.

    sigma : standard deviation, in units of the scene or radians as `KINDS` says; 0 is hard.
    """

    kind: str
    points: tuple[int, ...]
    value: tuple[float, ...] = ()
    sigma: float = 0.0


class Rows(NamedTuple):
    """Residuals (m,) of a constraint and their derivatives (m, k, 3) by its k points."""

    residual: Array
    by_point: Array


class Kind(NamedTuple):
    """rows : from places (k, 3) and the value. least : points. step : points come in groups of this many.

    values : numbers that must be given. angular : sigma is in radians.
    """

    rows: Callable[[Array, tuple[float, ...]], Rows]
    least: int
    step: int
    values: int
    angular: bool = False


def _survey(x: Array, value: tuple[float, ...]) -> Rows:
    return Rows((x - np.array(value)).ravel(), np.eye(3)[:, None, :].copy())


def _distance(x: Array, value: tuple[float, ...]) -> Rows:
    length, way = _way(x[0], x[1])
    return Rows(np.array([length - value[0]]), np.stack([-way, way])[None])


def _equal(x: Array, value: tuple[float, ...]) -> Rows:
    (a, one), (b, two) = _way(x[0], x[1]), _way(x[2], x[3])
    return Rows(np.array([a - b]), np.stack([-one, one, two, -two])[None])


def _on_plane(x: Array, value: tuple[float, ...]) -> Rows:
    """On the plane n . X = d; value is n and d."""
    size = max(float(np.linalg.norm(value[:3])), TINY)
    normal = np.array(value[:3]) / size
    return Rows(x @ normal - value[3] / size, np.eye(len(x))[:, :, None] * normal)


def _plane(x: Array, value: tuple[float, ...]) -> Rows:
    axes, flat = _axes(x)
    own = np.concatenate([np.ones((len(x), 1)), flat[:, :2]], axis=1)
    return _without(Rows(flat[:, 2], np.eye(len(x))[:, :, None] * axes[2]), own)


def _line(x: Array, value: tuple[float, ...]) -> Rows:
    axes, flat = _axes(x)
    own = np.concatenate([np.ones((len(x), 1)), flat[:, :1]], axis=1)
    sides = [_without(Rows(flat[:, k], np.eye(len(x))[:, :, None] * axes[k]), own) for k in (1, 2)]
    return Rows(*(np.concatenate(parts) for parts in zip(*sides, strict=True)))


def circle_of(x: Array) -> tuple[Array, Array, float]:
    """Centre, axes (3, 3: two in its plane, then the normal) and radius of the circle nearest to points (k, 3)."""
    axes, flat = _axes(x)
    plane = flat[:, :2]
    # the algebraic circle (Kasa, 1976), then the nearest one
    matrix = np.concatenate([2.0 * plane, np.ones((len(x), 1))], axis=1)
    found = np.linalg.lstsq(matrix, (plane**2).sum(axis=1), rcond=None)[0]
    middle, radius = found[:2], float(np.sqrt(max(found[2] + found[:2] @ found[:2], TINY)))
    for _ in range(ROUNDS):
        spoke = plane - middle
        length = np.maximum(np.linalg.norm(spoke, axis=1), TINY)
        own = np.concatenate([-spoke / length[:, None], -np.ones((len(x), 1))], axis=1)
        step = np.linalg.lstsq(own, radius - length, rcond=None)[0]
        middle, radius = middle + step[:2], radius + float(step[2])
    return x.mean(axis=0) + middle @ axes[:2], axes, radius


def _circle(x: Array, value: tuple[float, ...]) -> Rows:
    """On one circle; value is its radius where it is known."""
    centre, axes, radius = circle_of(x)
    flat = (x - centre) @ axes.T
    length = np.maximum(np.linalg.norm(flat[:, :2], axis=1), TINY)
    spoke = flat[:, :2] / length[:, None]
    one, eye = np.ones((len(x), 1)), np.eye(len(x))[:, :, None]
    height = _without(Rows(flat[:, 2], eye * axes[2]), np.concatenate([one, flat[:, :2]], axis=1))
    known = value[0] if value else radius
    own = spoke if value else np.concatenate([spoke, one], axis=1)
    around = _without(Rows(length - known, eye * (spoke @ axes[:2])[:, None, :]), own)
    return Rows(np.concatenate([height.residual, around.residual]), np.concatenate([height.by_point, around.by_point]))


def _parallel(x: Array, value: tuple[float, ...]) -> Rows:
    (a, one), (b, two) = _way(x[0], x[1]), _way(x[2], x[3])
    if one @ two < 0.0:
        two, b = -two, -b
    across = np.linalg.svd((one + two)[None])[2][1:]  # two directions across both
    by_one, by_two = _turned(a, one), _turned(b, two)
    rows = np.stack([-across @ by_one, across @ by_one, across @ by_two, -across @ by_two], axis=1)
    return Rows(across @ (one - two), rows)


def _right(x: Array, value: tuple[float, ...]) -> Rows:
    (a, one), (b, two) = _way(x[0], x[1]), _way(x[2], x[3])
    first, second = two @ _turned(a, one), one @ _turned(b, two)
    return Rows(np.array([one @ two]), np.stack([-first, first, -second, second])[None])


def _axis(x: Array, value: tuple[float, ...]) -> Rows:
    """From the first point to the second along a direction of the world, either way."""
    length, way = _way(x[0], x[1])
    across = np.linalg.svd(np.array([value]))[2][1:]
    turned = across @ _turned(length, way)
    return Rows(across @ way, np.stack([-turned, turned], axis=1))


def mirror_of(x: Array) -> tuple[Array, float]:
    """Normal n and distance d (n . X = d) of the plane that best mirrors x[0::2] onto x[1::2]."""
    a, b = x[0::2], x[1::2]
    normal = np.linalg.svd(b - a)[2][0]
    distance = float((0.5 * (a + b) @ normal).mean())
    for _ in range(ROUNDS):
        residual, own = _mirrored(a, b, normal, distance)
        step = np.linalg.lstsq(own.reshape(-1, 3), -residual.ravel(), rcond=None)[0]
        tangent = np.linalg.svd(normal[None])[2][1:]
        normal = normal + step[:2] @ tangent
        normal, distance = normal / np.linalg.norm(normal), distance + float(step[2])
    return normal, distance


def _mirrored(a: Array, b: Array, normal: Array, distance: float) -> tuple[Array, Array]:
    """b less the mirror of a, (m, 3), and its derivatives (m, 3, 3) by two turns of the normal and the distance."""
    height = a @ normal - distance
    tangent = np.linalg.svd(normal[None])[2][1:]
    turns = 2.0 * ((a @ tangent.T)[:, None, :] * normal[:, None] + height[:, None, None] * tangent.T)
    shift = np.broadcast_to(-2.0 * normal[:, None], (len(a), 3, 1))
    return b - a + 2.0 * height[:, None] * normal, np.concatenate([turns, shift], axis=2)


def _symmetric(x: Array, value: tuple[float, ...]) -> Rows:
    """Pairs, one point after its mirror image; value is the mirror's normal and distance where they are known."""
    pairs = len(x) // 2
    if value:
        size = max(float(np.linalg.norm(value[:3])), TINY)
        normal, distance = np.array(value[:3]) / size, value[3] / size
    else:
        normal, distance = mirror_of(x)
    residual, own = _mirrored(x[0::2], x[1::2], normal, distance)
    rows = np.zeros((pairs, 3, 2 * pairs, 3))
    k = np.arange(pairs)
    rows[k, :, 2 * k] = 2.0 * np.outer(normal, normal) - np.eye(3)
    rows[k, :, 2 * k + 1] = np.eye(3)
    found = Rows(residual.ravel(), rows.reshape(3 * pairs, 2 * pairs, 3))
    return found if value else _without(found, own.reshape(3 * pairs, 3))


KINDS: dict[str, Kind] = {
    "survey": Kind(_survey, 1, 1, 3),
    "distance": Kind(_distance, 2, 2, 1),
    "equal": Kind(_equal, 4, 4, 0),
    "on_plane": Kind(_on_plane, 1, 1, 4),
    "plane": Kind(_plane, 4, 1, 0),
    "line": Kind(_line, 3, 1, 0),
    "circle": Kind(_circle, 4, 1, 0),
    "parallel": Kind(_parallel, 4, 4, 0, angular=True),
    "right": Kind(_right, 4, 4, 0, angular=True),
    "axis": Kind(_axis, 2, 2, 3, angular=True),
    "symmetric": Kind(_symmetric, 4, 2, 0),
}
OPTIONAL = {"circle": 1, "symmetric": 4}  # values that may be given


def check(constraint: Constraint, points: int) -> None:
    """Raise UserError when a constraint cannot be what it says, of a scene of that many points."""
    kind = KINDS.get(constraint.kind)
    if kind is None:
        raise UserError(f"There is no constraint {constraint.kind!r}; there are {', '.join(KINDS)}.")
    count, values = len(constraint.points), len(constraint.value)
    exact = constraint.kind in ("survey", "distance", "equal", "parallel", "right", "axis")
    if count < kind.least or count % kind.step or (exact and count != kind.least):
        raise UserError(f"The constraint {constraint.kind} needs {kind.least} points{'' if exact else ' or more'}.")
    if values != kind.values and values != OPTIONAL.get(constraint.kind, kind.values):
        raise UserError(f"The constraint {constraint.kind} needs {kind.values} numbers, not {values}.")
    if constraint.kind in ("on_plane", "axis") and not any(constraint.value[:3]):
        raise UserError(f"The constraint {constraint.kind} needs a direction that is not zero.")
    if not all(0 <= k < points for k in constraint.points) or len(set(constraint.points)) < min(count, 3):
        raise UserError(f"The constraint {constraint.kind} names points that are not there, or one twice.")
    if not (np.isfinite(constraint.value).all() and np.isfinite(constraint.sigma) and constraint.sigma >= 0.0):
        raise UserError(f"The constraint {constraint.kind} has a number that is not finite, or a negative tolerance.")


class Pull:
    """Constraints as a quadratic cost on points, as :func:`core.match.solve.bundle.adjust` asks for it.

    scale : size of the scene; hard constraints are held to `hard` of it.
    """

    def __init__(self, constraints: Sequence[Constraint], points: int, scale: float, hard: float = HARD) -> None:
        for one in constraints:
            check(one, points)
        self.constraints, self._count, self._scale = tuple(constraints), points, max(scale, TINY)
        self._hard = hard

    def points(self) -> list[int]:
        """Rows of the points something is known of."""
        return sorted({row for one in self.constraints for row in one.points})

    def cost(self, points: Array) -> float:
        """Sum of the whitened squares at points (P, 3)."""
        return sum(float(rows.residual @ rows.residual) for _, rows in self._all(points))

    def normal(self, points: Array) -> tuple[float, Array, Array]:
        """Cost, right side (P, 3) and matrix (3P, 3P) of the normal equations at points (P, 3)."""
        cost, right, matrix = 0.0, np.zeros((self._count, 3)), np.zeros((3 * self._count, 3 * self._count))
        for one, rows in self._all(points):
            jacobian = rows.by_point.reshape(len(rows.residual), -1)
            at = (3 * np.array(one.points)[:, None] + np.arange(3)).ravel()
            cost += float(rows.residual @ rows.residual)
            np.add.at(right.reshape(-1), at, -jacobian.T @ rows.residual)
            np.add.at(matrix, (at[:, None], at[None, :]), jacobian.T @ jacobian)
        return cost, right, matrix

    def misses(self, points: Array) -> Array:
        """(C,) root mean square of what each constraint misses by, in its own unit, at points (P, 3)."""
        return np.array([
            np.sqrt(np.mean(KINDS[one.kind].rows(points[list(one.points)], one.value).residual ** 2))
            for one in self.constraints
        ])

    def _all(self, points: Array) -> list[tuple[Constraint, Rows]]:
        return [(one, self._whitened(one, points)) for one in self.constraints]

    def _whitened(self, one: Constraint, points: Array) -> Rows:
        kind = KINDS[one.kind]
        rows = kind.rows(points[list(one.points)], one.value)
        sigma = one.sigma or self._hard * (1.0 if kind.angular else self._scale)
        return Rows(rows.residual / sigma, rows.by_point / sigma)


def _way(a: Array, b: Array) -> tuple[float, Array]:
    """Distance and unit direction from a to b."""
    length = max(float(np.linalg.norm(b - a)), TINY)
    return length, (b - a) / length


def _turned(length: float, way: Array) -> Array:
    """(3, 3) derivative of a unit direction by its end."""
    return np.asarray((np.eye(3) - np.outer(way, way)) / length)


def _axes(x: Array) -> tuple[Array, Array]:
    """Principal axes (3, 3) of points (k, 3), the longest first, and their coordinates in them about the mean."""
    middle = x - x.mean(axis=0)
    axes = np.linalg.svd(middle, full_matrices=True)[2]
    return axes, middle @ axes.T


def _without(rows: Rows, own: Array) -> Rows:
    """Rows without what the shape's own unknowns, derivatives (m, n), take up."""
    base = np.linalg.qr(own)[0]
    flat = rows.by_point.reshape(len(rows.residual), -1)
    return Rows(
        rows.residual - base @ (base.T @ rows.residual), (flat - base @ (base.T @ flat)).reshape(rows.by_point.shape)
    )
