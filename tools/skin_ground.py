"""Ground that is a skin in a pose: where pointers meet it, and how large it is on the screen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from core.camera import clip_from_world, pixel_scale
from core.document import MeshObject
from core.evaluator import Evaluator
from core.groom.region import View
from core.mesh.bvh import cast_rays, closest_points
from core.mesh.skin import Skin
from core.transform import normalized
from tools.ground import Ground, Hit, Pointer, Sight

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])  # across the object's own X = 0 plane


@dataclass(frozen=True, kw_only=True)
class SkinGround(Ground):
    """A mesh in the pose shown at `frame`.

    skin : in that pose. rest : at rest.
    """

    item: MeshObject
    frame: float
    skin: Skin
    rest: Skin
    evaluator: Evaluator

    @property
    def size(self) -> float:
        """The diagonal at rest."""
        return self.rest.diagonal

    def hit(self, pointer: Pointer) -> Hit | None:
        """Where the pointer meets the skin, or None."""
        origin, direction = self.ray(pointer)
        distance, triangle, barycentric = cast_rays(
            self.skin.bvh, origin[None].astype(np.float32), direction[None].astype(np.float32))
        if triangle[0] < 0:
            return None
        corners = self.skin.triangles.vertices[triangle[0]]
        normal = barycentric[0].astype(np.float64) @ self.skin.normals[corners]
        return Hit(
            int(triangle[0]), barycentric[0], origin + float(distance[0]) * direction,
            normal / max(float(np.linalg.norm(normal)), 1e-12),
        )

    def pixels_per_metre(self, point: NDArray[np.float64] | None = None) -> float:
        """Pixels a metre across the view covers at a point (3,) of the object; at the middle of the skin when None."""
        camera = self.sight.camera
        scale = pixel_scale(camera, self.sight.height)
        if camera.orthographic:
            return scale
        at = 0.5 * (self.skin.points.min(axis=0) + self.skin.points.max(axis=0)) if point is None else point
        _, w = self.view.pixels(np.asarray(at, np.float64))
        return scale / max(float(w), 1e-9)


def both_sides(sight: Sight, symmetry: bool) -> tuple[tuple[View, bool], ...]:
    """How the artist looks, and with `symmetry` the mirror image of it; True beside the latter."""
    matrix = clip_from_world(sight.camera, sight.width, sight.height)
    sides = ((matrix, False), (matrix @ MIRROR, True)) if symmetry else ((matrix, False),)
    return tuple((View(side, sight.width, sight.height), mirrored) for side, mirrored in sides)


@dataclass(frozen=True, kw_only=True)
class TwoSidedGround(SkinGround):
    """A skin on which strokes may be mirrored across X = 0 as it is at rest."""

    def begun(self, pointer: Pointer) -> Self:
        """On the mirrored side of a pose: looked at as if the skin opposite to where the stroke begins were here.

        Sides are those of rest. A part that turns as a whole, as a head does, is mirrored exactly; a stroke that goes
        on over a joint keeps the image it began with.
        """
        if not self.mirrored or self.skin is self.rest:
            return self
        sight = self.sight
        own = View(clip_from_world(sight.camera, sight.width, sight.height), sight.width, sight.height)
        near = replace(self, view=own, mirrored=False)
        hit = near.hit(pointer)
        if hit is None:  # beside the animal: the skin nearest to the pointer
            pixels, depth = own.pixels(self.skin.points)
            away = np.hypot(pixels[:, 0] - pointer.x, pixels[:, 1] - pointer.y)
            nearest = self.skin.points[np.argmin(np.where(depth > 0.0, away, np.inf))]
            triangle, weights, _ = closest_points(self.skin.bvh, nearest[None])
            hit = Hit(int(triangle[0]), weights[0], nearest.astype(np.float64), np.zeros(3))
        return replace(self, view=own._replace(clip_from_object=own.clip_from_object @ self._image(hit)))

    def opposite(self, hit: Hit) -> NDArray[np.float64]:
        """The point (3,) of the skin that lies on the other side at rest, where it is now."""
        if self.skin is self.rest:
            return super().opposite(hit)
        return np.asarray((np.linalg.inv(self._image(hit)) @ [*hit.point, 1.0])[:3])

    def _image(self, hit: Hit) -> NDArray[np.float64]:
        """(4, 4) what the skin around the place opposite to a hit must be moved by to be the mirror image of the skin
        around the hit, in the pose shown."""
        turn, at_rest, posed = self._turned(hit.triangle, hit.barycentric)
        triangle, weights, _ = closest_points(self.rest.bvh, (at_rest * MIRROR.diagonal()[:3])[None].astype(np.float32))
        other_turn, _, other = self._turned(int(triangle[0]), weights[0])
        image = np.eye(4)
        image[:3, :3] = turn @ MIRROR[:3, :3] @ other_turn.T
        image[:3, 3] = posed - image[:3, :3] @ other
        return image

    def _turned(self, triangle: int, weights: NDArray[np.float32]) -> tuple[NDArray[np.float64], ...]:
        """How a triangle is turned from rest to the pose (3, 3), and a place of it at rest and in the pose, (3,)."""
        corners = self.rest.triangles.vertices[triangle]
        frames, places = [], []
        for points in (self.rest.points, self.skin.points):
            a, b, c = points[corners].astype(np.float64)
            along, normal = normalized(b - a), normalized(np.cross(b - a, c - a))
            frames.append(np.stack([along, np.cross(normal, along), normal], axis=1))
            places.append(weights.astype(np.float64) @ points[corners])
        return frames[1] @ frames[0].T, places[0], places[1]
