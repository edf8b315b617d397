"""Numbers of a rig from tracks: any of them, in every frame or shared by the shot, with priors and limits.

Least squares over all frames at once (Levenberg-Marquardt; what runs against a limit is held there for the step). What
a frame knows is its own block, what is shared crosses all of them, steadiness ties each frame to the next: the normal
equations are sparse. (The talk's "solver finds neck parameters matching body to head", with mmSolver's generality.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from core.errors import UserError
from core.match.solve.state import Array, Observations, State, projected, whitened

STEP = 1e-3  # of differences: radians, metres; skins are of single precision
TOLERANCE = 1e-8
MOST_DAMPING = 1e10
MOST_UNKNOWNS = 50_000


class Parameter(NamedTuple):
    """A number that is looked for. rest : where it begins, and what the prior is about. sigma : of the prior.

    low, high : its limits. shared : one number for all frames. steady : standard deviation of its change from one frame
    to the next, infinite where it may jump.
    """

    name: str
    rest: float = 0.0
    sigma: float = np.inf
    low: float = -np.inf
    high: float = np.inf
    shared: bool = False
    steady: float = np.inf


class Anchors(NamedTuple):
    """Places known in the world: frame (N,) and track (N,) int32 rows of a point, place (N, 3), sigma (N,) in units."""

    frame: NDArray[np.int32]
    track: NDArray[np.int32]
    place: Array
    sigma: Array


class Fit(NamedTuple):
    """values : (F, n). sigma : (F, n) standard deviations, with the noise that was found; 0 where a limit holds it.

    rms_px : of the tracks. noise : standard deviation of the whitened residuals, tracks and anchors. at_limit : (F, n).
    """

    values: Array
    sigma: Array
    rms_px: float
    noise: float
    at_limit: NDArray[np.bool_]


Places = Callable[[int, Array], Array]


def fit(
    parameters: Sequence[Parameter], places: Places, camera: State, observations: Observations,
    anchors: Anchors | None = None, *, scale: float = 0.0, iterations: int = 60,
) -> Fit:
    """Find the numbers with which points are seen where they were tracked.

    places : of a frame's row and its numbers (n,), the points (P, 3) in the world of the solver's camera.
    camera : F frames that are solved. observations : track is the row of a point.
    scale : of the Cauchy loss in standard deviations, 0 for squares.

    Raises
    ------
    UserError
        A parameter cannot be told, or there are too many of them.
    """
    problem = _Problem(parameters, places, camera, observations, anchors, scale)
    values, damping = problem.start(), 1e-3
    cost, matrix, right = problem.normal(values)
    for _ in range(iterations):
        step = problem.step(matrix, right, values, damping)
        tried = np.clip(values + step, problem.low, problem.high)
        after = problem.cost(tried)
        if after <= cost:
            gained = cost - after
            values, damping = tried, max(damping * 0.1, 1e-12)
            cost, matrix, right = problem.normal(values)
            if gained <= TOLERANCE * max(cost, 1e-30):
                break
            continue
        damping *= 10.0
        if damping > MOST_DAMPING:
            break
    return problem.told(values, matrix, right)


class _Problem:
    def __init__(
        self, parameters: Sequence[Parameter], places: Places, camera: State, observations: Observations,
        anchors: Anchors | None, scale: float,
    ) -> None:
        if not parameters:
            raise UserError("There is nothing to fit; name a parameter of the rig at least.")
        self._parameters, self._places, self._camera = tuple(parameters), places, camera
        self._observations, self._anchors, self._scale = observations, anchors, scale
        self._frames = len(camera.rotation)
        # column of each frame's parameter among all unknowns: the shared ones first
        shared = [k for k, one in enumerate(parameters) if one.shared]
        own = [k for k, one in enumerate(parameters) if not one.shared]
        self._column = np.zeros((self._frames, len(parameters)), int)
        self._column[:, shared] = np.arange(len(shared))
        self._column[:, own] = len(shared) + np.arange(self._frames * len(own)).reshape(self._frames, len(own))
        self._count = len(shared) + self._frames * len(own)
        if self._count > MOST_UNKNOWNS:
            raise UserError(f"{self._count:,} numbers are too many to fit at once; fit fewer frames.")
        self.low = self._spread([one.low for one in parameters])
        self.high = self._spread([one.high for one in parameters])
        if (self.low > self.high).any():
            raise UserError("A parameter has a lowest value above its highest.")
        self._rest = self._spread([one.rest for one in parameters])
        self._rows = [np.flatnonzero(observations.frame == f) for f in range(self._frames)]
        self._held = [
            np.flatnonzero(anchors.frame == f) if anchors is not None else np.zeros(0, int) for f in range(self._frames)
        ]
        self._prior = self._priors()

    def _spread(self, values: list[float]) -> Array:
        out = np.zeros(self._count)
        out[self._column] = np.broadcast_to(np.array(values, np.float64), self._column.shape)
        return out

    def _priors(self) -> csc_array:
        """The quadratic cost of priors and steadiness."""
        weight = self._spread([0.0 if np.isinf(one.sigma) else one.sigma**-2 for one in self._parameters])
        matrix = diags_array(weight, format="csc")
        rows, columns, entries = [], [], []
        for k, one in enumerate(self._parameters):
            if one.shared or np.isinf(one.steady):
                continue
            a, b = self._column[:-1, k], self._column[1:, k]
            rows += [a, b, a, b]
            columns += [a, b, b, a]
            entries += [np.full(len(a), sign / one.steady**2) for sign in (1.0, 1.0, -1.0, -1.0)]
        if rows:
            at = (np.concatenate(rows), np.concatenate(columns))
            matrix = matrix + csc_array((np.concatenate(entries), at), (self._count, self._count))
        return csc_array(matrix)

    def start(self) -> Array:
        """Where everything rests, within its limits."""
        return np.clip(self._rest, self.low, self.high)

    def _errors(self, f: int, values: Array) -> Array:
        """Whitened residuals of a frame: tracks first, two each, then anchors, three each."""
        points = np.asarray(self._places(f, values), np.float64)
        rows = self._observations.take(self._rows[f])
        xy, depth = projected(self._camera, rows.frame, points[rows.track])
        error = np.where((depth > 1e-9)[:, None], whitened(rows, xy - rows.xy), 1e3)
        held = self._held[f]
        if self._anchors is None or not len(held):
            return error.ravel()
        anchors = self._anchors
        apart = (points[anchors.track[held]] - anchors.place[held]) / anchors.sigma[held, None]
        return np.concatenate([error.ravel(), apart.ravel()])

    def _weights(self, f: int, error: Array) -> tuple[float, Array]:
        """Robust cost of a frame and the weights of its residuals."""
        if not self._scale:
            return float(error @ error), np.ones(len(error))
        pairs = 2 * len(self._rows[f])
        square = (error[:pairs].reshape(-1, 2) ** 2).sum(axis=1) / self._scale**2
        cost = self._scale**2 * float(np.log1p(square).sum()) + float((error[pairs:] ** 2).sum())
        return cost, np.concatenate([np.repeat(1.0 / (1.0 + square), 2), np.ones(len(error) - pairs)])

    def _of_priors(self, values: Array) -> float:
        away = values - self._rest
        return float(away @ (self._prior @ away))

    def cost(self, values: Array) -> float:
        """Of all frames, priors and steadiness."""
        of_frames = sum(self._weights(f, self._errors(f, values[self._column[f]]))[0] for f in range(self._frames))
        return of_frames + self._of_priors(values)

    def normal(self, values: Array) -> tuple[float, csc_array, Array]:
        """Cost, matrix and right side of the normal equations."""
        cost, right = self._of_priors(values), -(self._prior @ (values - self._rest))
        rows, columns, entries = [], [], []
        count = len(self._parameters)
        for f in range(self._frames):
            own = values[self._column[f]]
            error = self._errors(f, own)
            if not len(error):
                continue
            more, weight = self._weights(f, error)
            cost += more
            slope = np.empty((len(error), count))
            for k in range(count):
                step = np.zeros(count)
                step[k] = STEP * max(1.0, abs(float(own[k])))
                slope[:, k] = (self._errors(f, own + step) - self._errors(f, own - step)) / (2.0 * step[k])
            weighted = slope * weight[:, None]
            np.add.at(right, self._column[f], -weighted.T @ error)
            at = self._column[f]
            rows.append(np.repeat(at, count))
            columns.append(np.tile(at, count))
            entries.append((slope.T @ weighted).ravel())
        matrix = self._prior
        if rows:
            at = (np.concatenate(rows), np.concatenate(columns))
            matrix = matrix + csc_array((np.concatenate(entries), at), (self._count, self._count))
        return cost, csc_array(matrix), right

    def _free(self, values: Array, right: Array) -> NDArray[np.bool_]:
        """Unknowns that are not held by a limit they are pulled against."""
        pinned = ((values <= self.low) & (right < 0.0)) | ((values >= self.high) & (right > 0.0))
        return ~pinned

    def step(self, matrix: csc_array, right: Array, values: Array, damping: float) -> Array:
        """The damped step of what is free."""
        free = np.flatnonzero(self._free(values, right))
        out = np.zeros(self._count)
        if len(free):
            part = csc_array(matrix[free][:, free])
            damped = part + diags_array(damping * (part.diagonal() + 1e-12) + 1e-12, format="csc")
            out[free] = splu(csc_array(damped)).solve(right[free])
        return out

    def told(self, values: Array, matrix: csc_array, right: Array) -> Fit:
        """What was found and how sure it is."""
        free = np.flatnonzero(self._free(values, right))
        pixels, squares, number, known = 0.0, 0.0, 0, 0
        for f in range(self._frames):
            error = self._errors(f, values[self._column[f]])
            root = self._observations.root[self._rows[f]]
            squares += float(error @ error)
            known += len(error)
            error = error[: 2 * len(root)]
            pixels += float(((error.reshape(-1, 2) ** 2).sum(axis=1) / (root[:, 0] * root[:, 2])).sum())
            number += len(root)
        noise = float(np.sqrt(squares / max(1, known - len(free))))
        sigma = np.zeros(self._count)
        if len(free):
            part = csc_array(matrix[free][:, free])
            diagonal = part.diagonal()
            if (diagonal <= 0.0).any():
                column = int(free[int(np.argmin(diagonal))])
                name = self._parameters[int(np.argwhere(self._column == column)[0][1])].name
                raise UserError(f"Nothing that was tracked moves with {name}; leave it out, or give it a prior.")
            factor = splu(csc_array(part + diags_array(1e-12 * diagonal, format="csc")))
            spread = np.array([factor.solve(np.eye(1, len(free), k).ravel())[k] for k in range(len(free))])
            sigma[free] = max(noise, 1e-12) * np.sqrt(np.maximum(spread, 0.0))
        at_limit = (values <= self.low) | (values >= self.high)
        return Fit(
            values[self._column], sigma[self._column], float(np.sqrt(pixels / max(1, number))), noise,
            at_limit[self._column],
        )


