"""The craft of feathers: strokes say where the feathers of a coat stand and lie, and take single ones by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.document import Document, feathers_of, find_mesh, keys_of, with_feathers
from core.errors import UserError
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.plumages import Lying, Plumages
from core.groom.groom import Groom
from core.mesh.bvh import closest_points
from core.posed import skin_at
from tools.craft import Work
from tools.ground import Sight
from tools.skin_ground import TwoSidedGround, both_sides
from tools.tool import Tool

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class FeatherGround(TwoSidedGround):
    """What a stroke of feathers works on.

    coat, keys : at press. plumages : how coats lie. rest_frame : at which the coat is laid at rest.
    waits : a coat that was not laid yet is laid when it is asked for.
    """

    coat: FeatherCoat
    keys: Groom | None
    plumages: Plumages
    rest_frame: float
    waits: bool

    def lying(self) -> Lying | None:
        """How the coat lies in the pose shown; None while it is laid elsewhere and nobody waits for it."""
        mesh = self.item.mesh
        known = self.plumages.known(self.coat, self.keys, mesh, self.skin.points, self.frame)
        if known is not None or not self.waits:
            return known
        return self.plumages.lay(self.coat, self.keys, mesh, self.skin, self.frame, self.rest_frame)

    def shown(self, points_at_rest: ArrayLike) -> Array:
        """Points (N, 3) near the skin at rest, where the pose shown has them."""
        points = np.asarray(points_at_rest, np.float64)
        if self.skin is self.rest or not len(points):
            return points
        triangle, weights, _ = closest_points(self.rest.bvh, points.astype(np.float32))
        corners = self.skin.triangles.vertices[triangle]
        return np.einsum("nk,nkc->nc", weights.astype(np.float64), self.skin.points[corners].astype(np.float64))

    def in_view(self, points: ArrayLike) -> Array:
        """Pixels (N, 2) of points (N, 3) of the pose shown."""
        found: Array = self.view.pixels(points)[0]
        return found


class FeatherCraft:
    """Strokes that change a coat of feathers."""

    name = "feather"
    label = "Feathers"
    first = "shaft"
    edits = ("coat",)

    def __init__(self) -> None:
        self._known: tuple[tuple[Any, ...], tuple[FeatherGround, ...]] | None = None

    def grounds(self, session: Work, sight: Sight, tool: Tool[Any]) -> tuple[FeatherGround, ...]:
        """The coat at hand on one or both sides; UserError when there is none, or it is locked or hidden."""
        workspace, document = session.workspace, session.history.current
        coat = _coat_at_hand(session, document)
        item = find_mesh(document, coat.mesh_id)
        for what, name in ((coat, coat.name), (item, item.name)):
            if what.locked or what.hidden:
                word, done = ("locked", "unlock") if what.locked else ("hidden", "show")
                raise UserError(f"{name} is {word}; {done} it to work on its feathers.")
        key = document, workspace.frame, workspace.respect, sight, session.waits
        if self._known is None or not all(a is b or a == b for a, b in zip(self._known[0], key, strict=True)):
            frame, evaluator = workspace.frame, session.evaluator
            self._known = key, tuple(
                FeatherGround(
                    sight, view, document.unit, mirrored, item=item, frame=frame,
                    skin=skin_at(item, frame, evaluator), rest=skin_at(item, None, evaluator), evaluator=evaluator,
                    coat=coat, keys=keys_of(document, coat), plumages=session.plumages,
                    rest_frame=float(document.first_frame), waits=session.waits,
                )
                for view, mirrored in both_sides(sight, workspace.respect.symmetry)
            )
        return self._known[1]

    def matter(self, tool: Tool[Any], ground: FeatherGround) -> FeatherCoat:
        """The coat at press."""
        return ground.coat

    def document(self, document: Document, tool: Tool[Any], ground: FeatherGround, matter: FeatherCoat) -> Document:
        """The document with this coat."""
        return document if matter is ground.coat else with_feathers(document, matter)

    shown = document

    def place(self, session: Work, ground: FeatherGround) -> dict[str, Any]:
        """The keys, the frame and what is respected."""
        place = {"frame": ground.frame, "respect": session.workspace.respect}
        return place if ground.keys is None else {"groom": ground.keys.id, **place}

    def ready(self, tool: Tool[Any], ground: FeatherGround) -> bool:
        """Feathers that are not laid yet are waited for by the artist: nothing is picked blindly."""
        return True

    def wait(self, ground: FeatherGround) -> None:
        """Nothing to wait for."""

    def preparation(self, session: Work) -> Callable[[], object] | None:
        """Nothing: who shows the feathers lays them."""
        return None


def _coat_at_hand(session: Work, document: Document) -> FeatherCoat:
    """The coat whose keys are at hand, or the only one there is."""
    if not document.feathers:
        raise UserError("There are no feathers yet: dress a mesh with feathers first (find it by Ctrl+K).")
    groom = None
    if document.grooms:
        groom = session.groom
    coat = feathers_of(document, groom)
    if coat is None and len(document.feathers) > 1:
        raise UserError("Choose the keys of the feathers to work on, in the scene.")
    return document.feathers[0] if coat is None else coat
