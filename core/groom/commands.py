"""Every kernel of the groom by name, with seeded arguments: for scripts that try things and for the tests of undo.

A run is a pure function of the guides, the skin and the seed. What it does is plausible, not tasteful: rings of all
sizes from all sides, strengths from the seed. A new kernel gets a line in :data:`COMMANDS`; undo is then tested on it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.camera import clip_from_world, frame_points
from core.evaluator import Evaluator
from core.groom.clone import clone
from core.groom.collide import push_out
from core.groom.comb import comb
from core.groom.delete import delete
from core.groom.freeze import freeze, freeze_others, unfreeze
from core.groom.guides import Guides
from core.groom.hairspray import spray, wash
from core.groom.length import cut_at_line, cut_with_ring, grow, scale_length, set_length
from core.groom.mirror import mirror
from core.groom.plant import places_along, plant, plant_scatter
from core.groom.region import View, facing, screen_weights
from core.groom.resample import with_point_count
from core.groom.select import (
    select_all,
    select_ids,
    select_in_lasso,
    select_inverse,
    select_islands,
    select_less,
    select_more,
    select_none,
    select_with_ring,
)
from core.groom.smooth import smooth
from core.groom.straighten import straighten
from core.mesh.distance_field import DistanceField
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin, distance_field, skin_at_rest

PICTURE = 512  # pixels along a side of the views commands draw in
Array = NDArray[np.float64]


class SkinContext(NamedTuple):
    """What kernels know of the skin: its mesh at rest with what is derived from it, and the field to collide with."""

    skin: Skin
    field: DistanceField | None


class Command(NamedTuple):
    """One edit by name. `run` takes the guides, the skin and a seed for its arguments, and returns new guides."""

    name: str
    label: str
    run: Callable[[Guides, SkinContext, int], Guides]


class Draw(NamedTuple):
    """Arguments of one run, drawn from its seed."""

    rng: np.random.Generator
    context: SkinContext
    seed: int

    @property
    def unit(self) -> float:
        """A length on the scale of the skin, metres."""
        return 0.05 * max(self.context.skin.diagonal, 1e-6)

    def place(self) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        triangle = self.rng.integers(0, len(self.context.skin.triangles.vertices), 1).astype(np.int32)
        return triangle, self.rng.dirichlet(np.ones(3), 1).astype(np.float32)

    def view(self) -> View:
        camera = frame_points(
            self.context.skin.mesh.points, self.rng.normal(size=3), orthographic=bool(self.rng.integers(2)))
        return View(clip_from_world(camera, PICTURE, PICTURE), PICTURE, PICTURE)

    def path(self, corners: int = 4) -> Array:
        """A wandering path in pixels through the middle of the picture."""
        start = self.rng.uniform(0.2, 0.8, 2) * PICTURE
        return np.asarray(start + np.cumsum(self.rng.normal(0.0, 0.06 * PICTURE, (corners, 2)), axis=0))

    def radius(self) -> float:
        return float(self.rng.uniform(0.04, 0.3) * PICTURE)

    def weights(self, guides: Guides) -> Array:
        return screen_weights(guides.points, self.view(), self.path(), self.radius())


def skin_context(mesh: Mesh, evaluator: Evaluator, collide: bool = True) -> SkinContext:
    """The context of a mesh, its derived data remembered by the evaluator; without a field nothing collides."""
    return SkinContext(skin_at_rest(mesh, evaluator), distance_field(mesh, evaluator) if collide else None)


def _plant_one(guides: Guides, draw: Draw) -> Guides:
    return plant(guides, draw.context.skin, *draw.place(), field=draw.context.field)


def _plant_line(guides: Guides, draw: Draw) -> Guides:
    skin = draw.context.skin
    line = skin.mesh.points[skin.triangles.vertices[draw.place()[0][0]]]
    return plant(guides, skin, *places_along(skin, line, 0.3 * draw.unit), length=draw.unit)


def _plant_scatter(guides: Guides, draw: Draw) -> Guides:
    return plant_scatter(guides, draw.context.skin, int(draw.rng.integers(1, 12)), seed=draw.seed)


def _comb(guides: Guides, draw: Draw) -> Guides:
    view = draw.view()
    return comb(guides, view, draw.path(), draw.radius(), field=draw.context.field,
                strength=float(draw.rng.uniform(0.2, 1.0)), mask=facing(guides, view))


def _comb_tips(guides: Guides, draw: Draw) -> Guides:
    return comb(guides, draw.view(), draw.path(), draw.radius(), field=draw.context.field, tip_first=1.0, lift=0.3)


def _cut_line(guides: Guides, draw: Draw) -> Guides:
    return cut_at_line(guides, draw.view(), draw.path(6), minimum=0.1 * draw.unit)


def _cut_ring(guides: Guides, draw: Draw) -> Guides:
    return cut_with_ring(guides, draw.view(), draw.path(), 0.2 * draw.radius(), minimum=0.1 * draw.unit)


def _clone(guides: Guides, draw: Draw) -> Guides:
    if len(guides) == 0:
        return guides
    triangle, barycentric = draw.place()
    ids = draw.rng.choice(guides.ids, size=min(3, len(guides)), replace=False)
    return clone(
        guides, draw.context.skin, ids, int(triangle[0]), barycentric, scale=float(draw.rng.uniform(0.5, 1.5)),
        twist=float(draw.rng.uniform(-3.0, 3.0)), flip=bool(draw.rng.integers(2)), variation=0.3, seed=draw.seed,
        onto="new" if draw.rng.integers(2) else "strands", radius=draw.unit, field=draw.context.field,
    )


def _spray(guides: Guides, draw: Draw) -> Guides:
    return spray(guides, float(draw.rng.uniform(0.2, 1.2)), draw.weights(guides), 0.0, float(draw.rng.uniform(0.3, 1)))


def _delete(guides: Guides, draw: Draw) -> Guides:
    return delete(guides, draw.rng.random(len(guides)) < 0.1)


def _run(call: Callable[[Guides, Draw], Guides]) -> Callable[[Guides, SkinContext, int], Guides]:
    def run(guides: Guides, context: SkinContext, seed: int) -> Guides:
        return call(guides, Draw(np.random.default_rng(seed), context, seed))

    return run


_TABLE: tuple[tuple[str, str, Callable[[Guides, Draw], Guides]], ...] = (
    ("plant", "Plant", _plant_one),
    ("plant_line", "Plant along a line", _plant_line),
    ("plant_scatter", "Plant a scatter", _plant_scatter),
    ("comb", "Comb", _comb),
    ("comb_tips", "Comb the tips", _comb_tips),
    ("grow", "Grow", lambda g, d: grow(g, 0.3 * d.unit, d.weights(g).max(axis=1, initial=0.0))),
    ("shrink", "Shrink", lambda g, d: grow(g, -0.3 * d.unit, d.weights(g).max(axis=1, initial=0.0), 0.1 * d.unit)),
    ("set_length", "Set length", lambda g, d: set_length(g, d.unit * float(d.rng.uniform(0.3, 3.0)))),
    ("scale_length", "Scale length", lambda g, d: scale_length(g, float(d.rng.uniform(0.7, 1.4)))),
    ("cut_at_line", "Cut at a line", _cut_line),
    ("cut_with_ring", "Cut", _cut_ring),
    ("smooth", "Smooth", lambda g, d: smooth(g, across=0.3, weights=d.weights(g), field=d.context.field)),
    ("straighten", "Straighten", lambda g, d: straighten(g, float(d.rng.uniform(0.2, 1.0)), field=d.context.field)),
    ("clone", "Clone", _clone),
    ("spray", "Hairspray", _spray),
    ("wash", "Wash", lambda g, d: wash(g, float(d.rng.uniform(0.2, 1.2)), d.weights(g))),
    ("mirror", "Mirror", lambda g, d: mirror(g, d.context.skin, source=int(d.rng.choice([-1, 1])))),
    ("delete", "Delete", _delete),
    ("select", "Select", lambda g, d: select_with_ring(g, d.view(), d.path(), d.radius(), "toggle")),
    ("select_lasso", "Lasso", lambda g, d: select_in_lasso(g, d.view(), d.path(7))),
    ("select_some", "Select by id", lambda g, d: select_ids(g, g.ids[d.rng.random(len(g)) < 0.3])),
    ("select_all", "Select all", lambda g, d: select_all(g)),
    ("select_none", "Select nothing", lambda g, d: select_none(g)),
    ("select_inverse", "Invert the selection", lambda g, d: select_inverse(g)),
    ("select_more", "Grow the selection", lambda g, d: select_more(g)),
    ("select_less", "Shrink the selection", lambda g, d: select_less(g)),
    ("select_islands", "Select islands", lambda g, d: select_islands(g, d.context.skin.mesh)),
    ("freeze", "Freeze", lambda g, d: freeze(g)),
    ("freeze_others", "Freeze the others", lambda g, d: freeze_others(g) if g.selected.any() else g),
    ("unfreeze", "Thaw", lambda g, d: unfreeze(g)),
    ("resample", "Number of points", lambda g, d: with_point_count(g, int(d.rng.integers(4, 24)))),
    ("push_out", "Push out of the skin",
     lambda g, d: g if d.context.field is None else push_out(g, d.context.field)),
)

COMMANDS: dict[str, Command] = {name: Command(name, label, _run(call)) for name, label, call in _TABLE}
