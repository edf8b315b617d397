"""Scatter: guides spread evenly under the ring, over the whole animal, or where a map says."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.errors import UserError
from core.field import field
from core.groom.groom import Map
from core.groom.guides import Guides
from core.groom.maps import density_at
from core.groom.plant import plant, plant_scatter
from core.groom.rows import append_guides
from core.overlay import Overlays
from tools.groom.craft import GroomGround
from tools.ground import Pointer
from tools.places import Places, places_under
from tools.ring import RingParams, ring_overlays, ring_radius
from tools.tool import Stroke, Tool, Turn

SPACING = 0.015  # of the animal's diagonal, where none is given
TRIES = 6.0  # places tried for each that would fit
MOST_TRIES = 1500  # for one batch of samples
NEAR = 8  # roots looked at around a place


class ScatterParams(RingParams):
    """Settings of Scatter."""

    how: Annotated[Literal["ring", "everywhere", "map"], field(
        "Where", "A drag fills what the ring passes; or a click fills the whole animal, or a map.",
        choices=("ring", "everywhere", "map"))] = "ring"
    spacing: Annotated[float, field(
        "Spacing", "Least distance between guides the ring plants; 0 takes a seventieth of the animal.", "m", (0, 0.1),
        (0, 1e4))] = 0.0
    count: Annotated[int, field(
        "Count", "How many guides one click plants over the animal or where the map says.", "", (10, 5000),
        (1, 1_000_000), 10)] = 500
    map: Annotated[str, field(
        "Map", "Name of the groom's map that says where a click plants; empty takes the density map.")] = ""
    length: Annotated[float, field(
        "Length", "How long new guides are; 0 takes after their neighbours, or suits the animal.", "m", (0, 0.3),
        (0, 1e4))] = 0.0
    inherit: Annotated[int, field(
        "Take after", "How many guides nearby give a new one its shape; 0 plants straight ones.", "", (0, 8), (0, 64),
        1)] = 4


class Scatter(Tool[ScatterParams]):
    """Plants many guides."""

    name = "scatter"
    label = "Scatter"
    icon = "scatter"
    order = 11
    tooltip = "Plants guides evenly where the ring passes, or with one click over all of the animal."
    hint = "Drag: fill with guides   Eraser: delete"
    step = "Scatter"
    at_rest = True
    with_eraser = Turn("delete")
    Params = ScatterParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A drag that fills, or a click that scatters a count."""
        if self.params.how == "ring":
            return RingScatter(self.params, ground)
        return CountScatter(self.params, ground, None if self.params.how == "everywhere" else self._map(ground))

    def hover(self, ground: GroomGround, pointer: Pointer) -> Overlays:
        """The ring, where it is used."""
        return ring_overlays(self.params, ground, pointer) if self.params.how == "ring" else ()

    def _map(self, ground: GroomGround) -> Map:
        name = self.params.map or ground.groom.coat.density_map or ""
        found = ground.groom.map(name)
        if found is None:
            names = ", ".join(item.name for item in ground.groom.maps) or "none yet"
            raise UserError(f"This groom has no map named {name!r}; choose one of its maps ({names}).")
        return found


class RingScatter:
    """Plants where the ring passes until no place is farther than the spacing from a guide."""

    def __init__(self, params: ScatterParams, ground: GroomGround) -> None:
        self.params, self.ground = params, ground
        self.spacing = params.spacing or SPACING * ground.rest.diagonal
        self.roots = ground.guides.points[:, 0].astype(np.float64)
        self.normals = ground.guides.roots.frames[:, 2].astype(np.float64)
        self.tree = cKDTree(self.roots) if len(self.roots) else None
        self.last: Pointer | None = None
        self.batch = 0

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """Guides planted in the ring along these samples."""
        samples = pointers if self.last is None else (self.last, *pointers)
        self.last = pointers[-1]
        radius = ring_radius(self.params, self.ground, self.last)
        way = np.array([(p.x, p.y) for p in samples], np.float64)
        hit = self.ground.hit(self.last)
        gap = self.spacing * self.ground.pixels_per_metre(None if hit is None else hit.point)
        length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
        area = np.pi * radius * radius + 2.0 * radius * length
        tries = int(np.clip(TRIES * area / max(gap, 1.0) ** 2, 8, MOST_TRIES))
        # both sides of symmetry draw the same numbers, so they try mirrored places
        rng = np.random.default_rng([self.ground.seed, self.batch])
        self.batch += 1
        places = places_under(self.ground, _in_ring(rng, way, radius, tries))
        rows = self._free(places, guides)
        if len(rows) == 0:
            return guides
        p, ground, base = self.params, self.ground, self.ground.guides
        made = plant(
            base, ground.rest, places.triangle[rows], places.barycentric[rows], length=p.length or None,
            inherit=p.inherit, field=ground.rest_field,
        )
        new = np.arange(len(base), len(made))
        return append_guides(guides, made.roots.take(new), made.points[new])

    def finish(self, guides: Guides) -> Guides:
        """Nothing more is done at release."""
        return guides

    def overlays(self) -> Overlays:
        """Nothing but the ring."""
        return ()

    def _free(self, places: Places, guides: Guides) -> NDArray[np.int64]:
        """Rows of places that keep the spacing to all guides and to each other."""
        free = places.triangle >= 0
        if self.tree is not None:
            free &= ~self._crowded(places, self.tree, self.normals)
        fresh = guides.ids >= self.ground.groom.guides.next_id  # planted by this stroke, on either side
        if fresh.any():
            tree = cKDTree(guides.points[fresh, 0].astype(np.float64))
            free &= ~self._crowded(places, tree, guides.roots.frames[fresh, 2].astype(np.float64))
        rows = np.flatnonzero(free)
        taken = np.ones(len(rows), np.bool_)
        for a, b in sorted(cKDTree(places.rest[rows]).query_pairs(self.spacing)) if len(rows) else ():
            if taken[a] and taken[b] and float(places.normals[rows[a]] @ places.normals[rows[b]]) > 0.0:
                taken[b] = False
        return rows[taken]

    def _crowded(
        self, places: Places, tree: cKDTree, normals: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """(N,) bool: a root nearer than the spacing, on skin that faces the same way (the back of an ear is far)."""
        k = min(NEAR, len(normals))
        distance, near = tree.query(places.rest, k=list(range(1, k + 1)))
        same = np.einsum("nkc,nc->nk", normals[near], places.normals) > 0.0
        return np.asarray((same & (distance < self.spacing)).any(axis=1))


class CountScatter:
    """Plants an exact number at release."""

    def __init__(self, params: ScatterParams, ground: GroomGround, where: Map | None) -> None:
        self.params, self.ground, self.where = params, ground, where

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """Where it is clicked does not matter."""
        return guides

    def finish(self, guides: Guides) -> Guides:
        """Guides over the whole animal, or where the map says; symmetry does not double them."""
        ground, p = self.ground, self.params
        if ground.mirrored:
            return guides
        skin = ground.rest
        return plant_scatter(
            guides, skin, p.count, region=density_at(self.where, skin.mesh, skin.triangles), seed=ground.seed,
            length=p.length or None, inherit=p.inherit, field=ground.rest_field,
        )

    def overlays(self) -> Overlays:
        """Nothing is drawn."""
        return ()


def _in_ring(
    rng: np.random.Generator, way: NDArray[np.float64], radius: float, count: int
) -> NDArray[np.float64]:
    """Random pixels (count, 2) in a ring somewhere along the way."""
    at = rng.random(count) * (len(way) - 1)
    start = np.minimum(at.astype(np.int64), max(len(way) - 2, 0))
    end = np.minimum(start + 1, len(way) - 1)
    centre = way[start] + (way[end] - way[start]) * (at - start)[:, None]
    angle, distance = 2.0 * np.pi * rng.random(count), radius * np.sqrt(rng.random(count))
    return np.asarray(centre + distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))
