"""A camera path with its lens and points, as programs exchange it: what a solve gives away, what a file brings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.match.lens import bent, start_lens
from core.match.solve.solution import Solution
from core.match.solve.state import ASPECT, CENTRE_X, CENTRE_Y, FOCAL, Array, Rows
from core.match.solve.views import TIED
from core.mesh.mesh import Mesh

FLIP = np.diag([1.0, -1.0, -1.0])  # y down, z ahead <-> y up, z back


class Seen(NamedTuple):
    """Where points were seen: frame (N,) and point (N,) int32 rows of a shot, xy (N, 2) pixels of the plate."""

    frame: Rows
    point: Rows
    xy: Array


class Thing(NamedTuple):
    """What moved by itself: its mesh, frames (F,) int32 rising, world (F, 4, 4) world_from_object, y up."""

    name: str
    mesh: Mesh
    frames: Rows
    world: Array


class Shot(NamedTuple):
    """A camera of F frames and P points. Cameras as the solver has them: x right, y down, looking along +z.

    size : pixels of the plate. frames (F,) their numbers, rising. rotation (F, 3, 3) camera_from_world, translation
    (F, 3). focal (F,) pixels across. lens (L,) of `core/match/lens.py`; its focal length is that of the first frame.
    points (P, 3) in world, names of them. The world is y down as well; programs get it y up.
    seen : where the points were seen, where that is known. things : what moved by itself.
    """

    size: tuple[int, int]
    frames: Rows
    rotation: Array
    translation: Array
    focal: Array
    lens: Array
    points: Array
    names: tuple[str, ...]
    seen: Seen | None = None
    things: tuple[Thing, ...] = ()

    def centres(self) -> Array:
        """(F, 3) where the cameras stand."""
        return -np.einsum("fji,fj->fi", self.rotation, self.translation)

    @property
    def zooms(self) -> bool:
        """Whether the focal length changes."""
        return bool(np.ptp(self.focal) > 1e-9 * float(self.focal[0]))

    @property
    def off_centre(self) -> tuple[float, float]:
        """Pixels the centre of the lens lies right of and below that of the picture."""
        width, height = self.size
        return float(self.lens[CENTRE_X] - 0.5 * (width - 1)), float(self.lens[CENTRE_Y] - 0.5 * (height - 1))

    @property
    def stretch(self) -> float:
        """Height of a pixel's picture over its width: focal length in pixels down over that across."""
        return float(np.exp(self.lens[ASPECT]))

    def up(self) -> tuple[Array, Array]:
        """(F, 4, 4) world_from_camera and (P, 3) points with y up and cameras that look along -z."""
        matrix = np.tile(np.eye(4), (len(self.frames), 1, 1))
        matrix[:, :3, :3] = FLIP @ self.rotation.transpose(0, 2, 1) @ FLIP
        matrix[:, :3, 3] = self.centres() @ FLIP
        return matrix, np.asarray(self.points @ FLIP)

    def pixels(self, row: int, points: Array) -> Array:
        """(N, 2) where points (N, 3) are seen in the plate, lens and all."""
        seen = points @ self.rotation[row].T + self.translation[row]
        return bent(self.lens, float(np.log(self.focal[row]) - self.lens[FOCAL]), seen[:, :2] / seen[:, 2:])


def shot_of(solution: Solution, names: list[str]) -> Shot:
    """What a solve gives away: the frames of its first camera that are known, the points that are held."""
    known = np.flatnonzero(solution.known & (solution.views.camera == 0))
    held = np.flatnonzero(solution.held)
    state = solution.state
    focal = np.exp(state.lens[FOCAL] + state.focal[known]) * solution.pixel[known]
    if len(known) and np.ptp(focal) < 10.0 * TIED * focal[0]:  # held together, not equal
        focal = np.full(len(known), focal.mean())
    lens = state.lens.copy()
    lens[FOCAL] = np.log(focal[0]) if len(known) else lens[FOCAL]
    return Shot(
        solution.size, solution.frames[known], state.rotation[known], state.translation[known], focal, lens,
        state.points[held], tuple(names[k] for k in held), _seen(solution, known, held),
    )


def _seen(solution: Solution, known: NDArray[np.intp], held: NDArray[np.intp]) -> Seen:
    """The observations that were used, of frames `known` and points `held`."""
    frame, point = np.full(len(solution.known), -1, np.int32), np.full(len(solution.held), -1, np.int32)
    frame[known], point[held] = np.arange(len(known)), np.arange(len(held))
    part = solution.observations.take(solution.used & (frame[solution.observations.frame] >= 0))
    middle = solution.state.lens[[CENTRE_X, CENTRE_Y]]
    return Seen(
        frame[part.frame], point[part.track], middle + (part.xy - middle) * solution.pixel[part.frame, None])


def shot_from_up(
    size: tuple[int, int], frames: Rows, matrix: Array, focal: Array, points: Array, names: tuple[str, ...] = (),
    lens: Array | None = None,
) -> Shot:
    """A shot from (F, 4, 4) world_from_camera and points with y up; without `lens` one that does not bend."""
    rotation = np.ascontiguousarray(FLIP @ matrix[:, :3, :3].transpose(0, 2, 1) @ FLIP)
    translation = -np.einsum("fij,fj->fi", rotation, matrix[:, :3, 3] @ FLIP)
    if lens is None:
        lens = start_lens(float(focal[0]), *size)
    names = names or tuple(f"point{k + 1}" for k in range(len(points)))
    return Shot(size, frames, rotation, translation, focal, lens, points.reshape(-1, 3) @ FLIP, names)
