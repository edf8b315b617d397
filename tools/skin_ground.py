"""Ground that is a skin in a pose: where pointers meet it, and how large it is on the screen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.camera import pixel_scale
from core.document import MeshObject
from core.evaluator import Evaluator
from core.mesh.bvh import cast_rays
from core.mesh.skin import Skin
from tools.ground import Ground, Hit, Pointer


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
