"""How the artist looks: the camera of the desk, the point its moves are about, and what gestures do to it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.window.desk import Desk
from app.window.jobs import Asked, Progress
from app.window.keymap import Navigation
from app.window.match.eye import PlateEye
from core import navigate
from core.camera import Camera, frame_points, ray_through
from core.mesh.bvh import cast_rays
from core.mesh.mesh import Mesh
from core.mesh.skin import skin_at_rest
from core.mesh.surface import strands_on_deformed
from core.posed import skin_at
from tools.scene import active_mesh

Array = NDArray[np.float64]

TURN = 0.0075  # radians for a pixel of Qt's
PULL = 0.006  # of a dolly, in powers of e for a pixel
NOTCH = 0.86  # of the distance is left after a notch of the wheel
AHEAD = (0.0, 0.0, 1.0)
AROUND = 4.0  # times what is looked at fits in the view
LENS = 0.5  # radians, the vertical field of view to begin with


class Eye:
    """The camera of a desk.

    Parameters
    ----------
    size : of the picture in pixels of the framebuffer. ratio : of these to pixels of Qt. changed : called when the
        camera of a workspace without one has become another. plate : how a plate is looked at while one is shown.
    """

    def __init__(
        self, desk: Desk, size: Callable[[], tuple[int, int]], ratio: Callable[[], float],
        changed: Callable[[], object], plate: PlateEye | None = None,
    ) -> None:
        self.desk, self.size, self.ratio, self.changed = desk, size, ratio, changed
        self._plate = plate
        self.trackball = False  # how orbiting turns; tumbling is the other way
        self._pivot: Array | None = None
        self._corners: tuple[object, Array] | None = None
        self._front: tuple[Mesh, tuple[float, float, float]] | None = None
        self._looking: Mesh | None = None
        self._given: Camera | None = None  # to a workspace without one
        self._meanwhile: tuple[object, Camera] | None = None  # until its front is found

    @property
    def flat(self) -> PlateEye | None:
        """How the plate is looked at, while one is shown."""
        return self._plate if self._plate is not None and self._plate.shown else None

    @property
    def camera(self) -> Camera:
        """The camera of the workspace; when it has none, it is given one that sees everything."""
        if self.flat is not None:
            return self.flat.camera
        cameras = self.desk.workspace.cameras
        if cameras:
            return cameras[0]
        if self.desk.document.meshes and self.facing is None:
            self._find_front()
            seen = (self.desk.document.meshes, self.size())
            if self._meanwhile is None or self._meanwhile[0] != seen:
                self._meanwhile = (seen, self._whole_view())
            return self._meanwhile[1]
        self._meanwhile = None
        camera = self._whole_view()
        if self.desk.document.meshes:
            self._given = camera
            self.desk.set_workspace(cameras=(camera,))
        return camera

    def resized(self) -> None:
        """The picture has another size: a camera that was given and not moved since sees everything again.

        So the first view does not depend on how soon the window had its size.
        """
        cameras = self.desk.workspace.cameras
        if cameras and cameras[0] is self._given:
            self._given = self._whole_view()
            self.desk.set_workspace(cameras=(self._given, *cameras[1:]))

    def _whole_view(self) -> Camera:
        camera = frame_points(self.points(), self._direction("three-quarter"), self._aspect(), field_of_view=LENS)
        return navigate.with_clipping(camera, self.corners())

    def look(self, camera: Camera) -> None:
        """Look through a camera; near and far are put about what there is."""
        if self.flat is not None:
            self.flat.look(camera)
            return
        clipped = navigate.with_clipping(camera, self.corners())
        self.desk.set_workspace(cameras=(clipped, *self.desk.workspace.cameras[1:]))

    def look_from(self, side: str) -> None:
        """Turn to one of the sides of the animal, about what was looked at; the first time when its front is found."""
        if self.flat is not None:
            self.desk.said.emit("A plate is seen straight on; drag it, or zoom with the wheel.")
        elif self.facing is None:
            self._find_front(lambda: self.look_from(side))
        else:
            self.look(navigate.turned_to(self.camera, self.pivot, self._direction(side)))

    def frame_all(self) -> None:
        """Come so near or far that everything just fits."""
        if self.flat is not None:
            self.flat.fit()
            return
        self._pivot = None
        self.look(navigate.frame(self.camera, self.points(), self._aspect()))

    def frame_selected(self) -> None:
        """The same for the selected guides; everything when none are. On a plate the active track in the middle."""
        if self.flat is not None:
            self.flat.find_active()
            return
        groom = self.desk.groom
        if groom is None or not groom.guides.selected.any():
            self.frame_all()
            return
        item = next(m for m in self.desk.document.meshes if m.id == groom.mesh_id)
        skin = skin_at(item, self.desk.workspace.frame, self.desk.session.evaluator)
        guides = groom.guides
        posed = strands_on_deformed(item.mesh, guides.roots, guides.points, skin.points, skin.normals)
        points = posed[guides.selected].reshape(-1, 3).astype(np.float64)
        self._pivot = points.mean(axis=0)
        self.look(navigate.frame(self.camera, points, self._aspect()))

    def view_of(self, points: ArrayLike, outward: ArrayLike) -> Camera:
        """A camera on points (N, 3) and as much around them, from the side `outward` (3,) looks to."""
        places = np.asarray(points, np.float64).reshape(-1, 3)
        middle = places.mean(axis=0)
        towards = -np.asarray(outward, np.float64)
        return frame_points(middle + AROUND * (places - middle), towards, self._aspect(), field_of_view=LENS)

    def toggle_projection(self) -> None:
        """A lens or parallel rays; what is looked at keeps its size."""
        if self.flat is None:
            self.look(navigate.with_projection(self.camera, self.pivot, not self.camera.orthographic))

    def pinch(self, x: float, y: float, factor: float) -> None:
        """Come nearer to what is under the cursor: `factor` times the distance is left."""
        self.look(navigate.dolly(self.camera, self.take_pivot(x, y), factor))

    def wheel(self, action: Navigation, notches: float, x: float, y: float) -> None:
        """What the wheel does to the view."""
        factor = NOTCH**notches
        if action == "zoom" and self.flat is None:
            self.look(navigate.zoom(self.camera, factor))
        else:
            self.pinch(x, y, factor)

    @property
    def pivot(self) -> Array:
        """The point of the last move, else the middle of everything (the middle of the view when that is behind)."""
        camera = self.camera
        for point in (self._pivot, self.corners().mean(axis=0)):
            if point is not None and navigate.depth_of(camera, point) > camera.near:
                return point
        return camera.position + max(2.0 * camera.near, 1.0) * camera.forward

    def take_pivot(self, x: float, y: float) -> Array:
        """Make what lies under a pixel the pivot, when there is skin; otherwise it stays as it was."""
        if self.flat is not None:
            return self.flat.under(x, y)
        found = self.under(x, y)
        if found is not None:
            self._pivot = found
        return self.pivot

    def under(self, x: float, y: float) -> Array | None:
        """The point (3,) of the skin shown that is under a pixel, or None."""
        width, height = self.size()
        ray = ray_through(self.camera, (x, y), width, height)
        nearest, frame, view = math.inf, self.desk.workspace.frame, self.desk.workspace.view
        for item in self.desk.document.meshes:
            if not item.hidden and (not view.isolated or item.id in view.isolated):
                skin = skin_at(item, frame, self.desk.session.evaluator)
                found, _, _ = cast_rays(
                    skin.bvh, ray.origin[None].astype(np.float32), ray.direction[None].astype(np.float32))
                nearest = min(nearest, float(found[0]))
        return ray.origin + nearest * ray.direction if math.isfinite(nearest) else None

    def points(self) -> Array:
        """Points (N, 3) of everything shown: skin in the pose of the frame, and the room its guides need."""
        document, workspace = self.desk.document, self.desk.workspace
        clouds: list[Array] = []
        for item in document.meshes:
            if item.hidden or (workspace.view.isolated and item.id not in workspace.view.isolated):
                continue
            skin = skin_at(item, workspace.frame, self.desk.session.evaluator)
            points = skin.points[np.unique(item.mesh.corners)]
            clouds.append(points)
            length = max((_longest(g.guides.points) for g in document.grooms if g.mesh_id == item.id), default=0.0)
            if length:
                clouds += [points + length * axis for axis in (*np.eye(3), *-np.eye(3))]
        return np.concatenate(clouds).astype(np.float64) if clouds else np.zeros((0, 3))

    def corners(self) -> Array:
        """(8, 3) the corners of a box about all meshes at rest and a quarter more; of a cube when there are none."""
        meshes = self.desk.document.meshes
        if self._corners is None or self._corners[0] is not meshes:
            ends = np.array([[-0.5, 0.0, -0.5], [0.5, 1.0, 0.5]])
            used = [m.mesh.points for m in meshes if len(m.mesh.points)]
            if used:
                low = np.min([p.min(axis=0) for p in used], axis=0).astype(np.float64)
                high = np.max([p.max(axis=0) for p in used], axis=0).astype(np.float64)
                more = 0.25 * float(np.linalg.norm(high - low))
                ends = np.stack([low - more, high + more])
            self._corners = meshes, np.array([
                (ends[i, 0], ends[j, 1], ends[k, 2]) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
        return self._corners[1]

    def _aspect(self) -> float:
        width, height = self.size()
        return width / height

    @property
    def facing(self) -> tuple[float, float, float] | None:
        """Where the active animal looks, (x, 0, z) unit; None until it was found out, straight on without one."""
        item = active_mesh(self.desk.document, self.desk.workspace)
        if item is None:
            return AHEAD
        return self._front[1] if self._front is not None and self._front[0] is item.mesh else None

    def _find_front(self, then: Callable[[], object] = lambda: None) -> None:
        """Find out in a job where the animal looks; that takes a moment on the way over its whole skin."""
        item = active_mesh(self.desk.document, self.desk.workspace)
        if item is None or self._looking is item.mesh:
            return
        mesh, evaluator = item.mesh, self.desk.session.evaluator
        self._looking = mesh

        def done(front: tuple[float, float, float]) -> None:
            self._front, self._looking = (mesh, front), None
            then()
            self.changed()

        def failed(error: Exception) -> None:
            done(AHEAD)

        def look(progress: Progress, cancelled: Asked) -> tuple[float, float, float]:
            from app.deliver import turned_view  # with all that writes coats: an empty window does without

            return turned_view(AHEAD, skin_at_rest(mesh, evaluator))

        self.desk.jobs.start(f"Look at {item.name}", look, done, failed)

    def _direction(self, side: str) -> tuple[float, float, float]:
        (x, y, z), (right, _, front) = navigate.SIDES[side], self.facing or AHEAD
        return front * x + right * z, y, front * z - right * x


WORDS = {
    "orbit": "Drag: turn about what was under the pointer", "tumble": "Drag: roll about what was under the pointer",
    "pan": "Drag: slide the view", "dolly": "Drag up: nearer, down: farther",
    "zoom": "Drag up: longer lens, down: wider",
}


class CameraDrag:
    """A gesture that moves the camera from press to release. words : what moving does."""

    def __init__(self, eye: Eye, action: Navigation, x: float, y: float) -> None:
        if eye.flat is not None:  # a plate does not turn
            action = "pan" if action in ("orbit", "tumble", "pan") else "dolly"
        self._eye, self._action = eye, action
        self.words = WORDS[action]
        self._before = eye.camera
        self._pivot = eye.take_pivot(x, y)
        self._last = self._next = (x, y)

    def move(self, x: float, y: float) -> None:
        """The hand is there now; the camera follows with the next picture."""
        self._next = (x, y)

    def frame(self) -> None:
        """Follow all that moved since the last picture."""
        if self._next == self._last:
            return
        across, down = self._next[0] - self._last[0], self._next[1] - self._last[1]
        self._last = self._next
        camera, ratio = self._eye.camera, self._eye.ratio()
        if self._action in ("orbit", "tumble"):
            turn = navigate.tumble if self._eye.trackball == (self._action == "orbit") else navigate.orbit
            camera = turn(camera, self._pivot, -TURN * across / ratio, TURN * down / ratio)
        elif self._action == "pan":
            camera = navigate.pan(camera, self._pivot, across, down, self._eye.size()[1])
        elif self._action == "dolly":
            camera = navigate.dolly(camera, self._pivot, math.exp(PULL * (down - across) / ratio))
        else:
            camera = navigate.zoom(camera, math.exp(PULL * (down - across) / ratio))
        self._eye.look(camera)

    def end(self) -> None:
        """The button is released."""
        self.frame()

    def cancel(self) -> None:
        """Look as before the press."""
        self._eye.look(self._before)


def _longest(points: np.ndarray) -> float:
    """Length of the longest guide, points (N, P, 3)."""
    if not len(points):
        return 0.0
    return float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1).max())
