"""A coat of feathers evaluated: static calculations once, those of a frame apart (the production rule of 2001).

Stages remember what they were made from by identity: combing keys comes in at the interpolation, a frame at the
carrying. Nothing here reads another frame.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core import value as values
from core.curve import Curve
from core.evaluator import Evaluator
from core.feather.coat.base import (
    Base,
    Stand,
    changed_rows,
    curved,
    drawn_in,
    lie_down,
    limited,
    own_curves,
    seed_of,
    strained,
)
from core.feather.coat.bed import Bed, bind_to_keys, field_directions, make_bed
from core.feather.coat.coat import FEATHER_FIELDS, FEATHER_VALUES, FeatherCoat
from core.feather.coat.crossing import vane_boxes
from core.feather.coat.frames import carried, field_frames, key_frames
from core.feather.coat.ground import smoothed
from core.feather.coat.keys import attributes_of_keys, interpolate, key_shapes
from core.feather.coat.layering import Feathers, Layered, layer, layer_again
from core.feather.coat.nearing import clearances, drawn_from_skin
from core.feather.coat.order import growth_order, roll_sides
from core.feather.coat.place import place_feathers
from core.feather.coat.posing import LENGTH, pose_vanes
from core.feather.coat.proxy import apply_proxies
from core.feather.coat.wing_pose import wings_move
from core.feather.coat.winged import COLUMNS, ROWS, Laid, winged
from core.feather.coat.worn import for_all, worn_values
from core.feather.presets import load_bird
from core.feather.vane import SHAPE_COLUMNS, vane_grids
from core.groom.groom import Groom, Map
from core.groom.maps import sample_map
from core.mesh.intrinsic import Binding
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin, skin_at_rest
from core.random import rand
from core.value import Formula, Value, evaluate_within, names_used
from core.workers import Workers

STANDING = 0.28  # radians, lift of feathers without keys
SIZED = ("shaftLength", "vaneWidthLeft", "vaneWidthRight")  # what length and width of the coat act on


class Plumage:
    """Evaluates one coat again and again. Mutable; owned by whoever shows, exports or measures it.

    Parameters
    ----------
    evaluator : whose threads and memory are used.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator
        self._memory: dict[str, tuple[tuple[Any, ...], Any]] = {}

    def at_rest(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, frame: float = 1001.0, quick: bool = False
    ) -> Laid:
        """The coat on the mesh at rest, without what proxies do; animated values as at `frame`. Feathers of wings come
        after all others.

        quick : while an artist works: only feathers that changed since the last call, and those over them, settle
            anew. What is kept or written never depends on what was there before.
        """
        return self._winged(coat, mesh, self._at_rest(coat, keys, mesh, frame, quick), frame)

    def _at_rest(self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, frame: float, quick: bool = False) -> Laid:
        bed, binding = self.bed(coat, keys, mesh), self._binding(coat, keys, mesh)
        full = self._memory.get("layer")
        quick = quick and full is not None
        if not quick:  # the order is that of the whole coat, not of what it was while a brush moved
            self._memory.pop("kept order", None)
        elif "kept order" not in self._memory and "order" in self._memory:
            self._memory["kept order"] = self._memory["order"]
        base = self._remember(
            "base", lambda: self._base(coat, keys, mesh, bed, binding, frame), *_looks(coat), keys, mesh, frame, quick)
        skin = skin_at_rest(mesh, self._evaluator)
        layered = self._settled(coat, base, bed, skin, quick)
        return self._laid(coat, bed, layered, base, skin, frame)

    def at_frame(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, skin: Skin, frame: float, rest_frame: float = 1001.0
    ) -> Laid:
        """The coat on `skin`, the mesh as it is posed at `frame`, from the order and the settling at rest."""
        rest = self._at_rest(coat, keys, mesh, rest_frame)
        still = skin.points is mesh.points and not moving(coat)
        if still and not coat.proxies:
            return self._winged(coat, mesh, rest, frame)
        bed, workers = rest.bed, self._evaluator.workers
        resting: Base = self._memory["base"][1]
        base, layered = resting, rest.layered
        if not still:
            base = self._base(coat, keys, mesh, bed, self._binding(coat, keys, mesh), rest_frame, skin, frame)
            settled = self._winged(coat, mesh, rest, rest_frame).layered.poses[: len(resting.poses)]
            poses = base.poses + (settled - resting.poses)
            poses[:, LENGTH] = base.poses[:, LENGTH] * settled[:, LENGTH] / resting.poses[:, LENGTH]
            if coat.layered:
                clear = _clear(base.feathers, poses, skin, workers)
                poses[:, LENGTH] *= drawn_from_skin(base.feathers.own, self._clearances(rest), clear)
                layered = layer(base.feathers, poses, bed.ground.near, skin.bvh, workers, at_rest=False)
            else:
                layered = _unlayered(base.feathers, poses, workers.ranges)
        if coat.proxies:
            frames = self.root_frames(coat, keys, mesh, skin)
            layered = apply_proxies(coat, rest.ids, base.feathers, frames, layered, frame, skin.bvh, workers)
        return self._winged(coat, mesh, self._laid(coat, bed, layered, base, skin, frame), frame)

    def _clearances(self, rest: Laid) -> NDArray[np.float32]:
        """How far the skin lies off the feathers at rest."""
        laid, workers = rest.layered, self._evaluator.workers
        known: NDArray[np.float32] = self._remember(
            "clearances", lambda: clearances(laid.vanes, laid.poses[:, LENGTH], rest.skin, workers), laid, rest.skin)
        return known

    def bed(self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh) -> Bed:
        """Where the feathers of a coat stand."""
        maps = () if keys is None else keys.maps
        made: Bed = self._remember(
            "bed", lambda: make_bed(coat, mesh, place_feathers(coat, mesh, maps, self._evaluator), self._evaluator),
            mesh, coat.placements, coat.tracts, maps,
        )
        return made

    def _winged(self, coat: FeatherCoat, mesh: Mesh, laid: Laid, frame: float) -> Laid:
        """The coat with the feathers of its wings, which lie where they lie; those around make way."""
        if not coat.wings:
            return laid
        by_itself = frame if wings_move(coat.wings) else None
        name = "wings at rest" if laid.skin.points is mesh.points else "wings"
        made: Laid = self._remember(
            name, lambda: winged(coat, mesh, laid, frame, self._evaluator), coat, mesh, laid.layered, laid.skin.points,
            by_itself)
        return made

    # -- stages --------------------------------------------------------------------------------------------

    def _remember(self, name: str, make: Callable[[], Any], *inputs: Any) -> Any:
        known = self._memory.get(name)
        if known is not None and len(known[0]) == len(inputs) and all(map(_same, known[0], inputs)):
            return known[1]
        made = make()
        self._memory[name] = (inputs, made)
        return made

    def _binding(self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh) -> Binding | None:
        if keys is None or not len(keys.guides):
            return None
        bed, guides = self.bed(coat, keys, mesh), keys.guides
        if not len(bed.places.ids):
            return None
        return self._remember(
            "binding", lambda: bind_to_keys(mesh, guides, bed.places, self._evaluator), bed, guides.roots
        )

    def _settled(self, coat: FeatherCoat, base: Base, bed: Bed, skin: Skin, quick: bool) -> Layered:
        """The feathers at rest, settled: from nothing, or for a `quick` look from what was there before."""
        workers = self._evaluator.workers

        def whole() -> Layered:
            if not coat.layered:
                return _unlayered(base.feathers, base.poses, workers.ranges)
            return layer(base.feathers, base.poses, bed.ground.near, skin.bvh, workers)

        full = self._memory.get("layer")
        before = self._memory.get("quick", full)
        if not quick or before is None or not coat.layered or (full is not None and full[0][1] is base):
            self._memory.pop("quick", None)
            return self._remember("layer", whole, coat.layered, base)
        (was_layered, known_base), laid = before

        def again() -> Layered:
            changed = changed_rows(known_base, base) if was_layered else None
            if changed is None or len(changed) > len(base.poses) // 3:
                return whole()
            return layer_again(base.feathers, laid, base.poses, changed, skin.bvh, workers)

        return self._remember("quick", again, coat.layered, base)

    def root_frames(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, skin: Skin | None = None
    ) -> NDArray[np.float32]:
        """Frames (N, 3, 3) of the roots, rows right, along, out, as keys lay them: what proxies are kept in."""
        bed = self.bed(coat, keys, mesh)
        rest, flow = self._directions(coat, keys, mesh, bed, self._binding(coat, keys, mesh))
        if skin is None or skin.points is mesh.points:
            return rest
        return carried(mesh, bed, rest, flow, skin)[1]

    def _base(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, bed: Bed, binding: Binding | None, rest_frame: float,
        skin: Skin | None = None, frame: float | None = None,
    ) -> Base:
        """Poses before settling, at rest (skin None) or carried to a posed skin."""
        ranges = self._evaluator.workers.ranges
        near, count = bed.ground.near, len(bed.places.ids)
        directions = self._directions(coat, keys, mesh, bed, binding)
        rest_frames, flow_frames = directions
        bend_of = self._remember(
            "curvature", lambda: curved(bed.positions, flow_frames, near, ranges), bed, directions)
        fields = self._fields(coat, keys, mesh, bed, binding, directions, bend_of)
        kept = self._memory.get("kept order")
        if kept is not None and len(kept[1][0]) == count:
            rank, sides = kept[1]
        else:
            rank, sides = self._remember("order", lambda: _ordered(bed, flow_frames, ranges), bed, directions)
        now = rest_frame if frame is None else frame
        own = self._remember(
            "own", lambda: self._own(coat, fields, rest_frame, mesh, keys, bed), fields, coat.attributes, coat.dials,
            coat.width, coat.preset, None if keys is None else keys.maps)
        if (now != rest_frame and any(moves(item.value) for item in coat.attributes)) or moves(coat.width):
            own = self._own(coat, fields, now, mesh, keys, bed)  # what is animated, at this frame alone
        numbers = {name: self._number(coat, name, fields, now, mesh, keys, bed) for name in FEATHER_VALUES}
        if skin is None:
            fields["limit"] = limited(fields["length"], bend_of)
            stand = Stand(bed.positions, rest_frames, bend_of, fields["limit"])
        else:
            positions, frames, flow = carried(mesh, bed, rest_frames, flow_frames, skin)
            bends = curved(positions, flow, near, ranges)
            strain = strained(bed.positions, flow_frames, positions, flow, near)
            drawn = drawn_in(fields["length"], bend_of, bends, strain)
            stand = Stand(positions, frames, bends, fields["limit"] * drawn)
        curves = self._remember("own curves", lambda: own_curves(own), own)
        return lie_down(coat, bed, stand, numbers, fields, own, curves, rank, sides)

    def _directions(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, bed: Bed, binding: Binding | None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Frames (N, 3, 3) of the feathers and, smoother, of the flow they lie in; rows right, along, out."""
        if binding is not None and keys is not None and coat.direction == "keys":
            guides = keys.guides
            return self._remember(
                "directions", lambda: key_frames(guides, binding, bed, self._evaluator.workers.ranges),
                bed, binding, guides.points, coat.direction,
            )
        field = self._remember(
            "field", lambda: field_directions(coat.direction, coat.strokes, mesh, self._evaluator),
            mesh, coat.direction, coat.strokes,
        )
        return self._remember(
            "directions", lambda: field_frames(field, bed, mesh, self._evaluator), bed, field, None, coat.direction
        )

    def _fields(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, bed: Bed, binding: Binding | None,
        directions: tuple[NDArray[np.float32], NDArray[np.float32]], bend_of: NDArray[np.float64],
    ) -> dict[str, Any]:
        """What keys say of every feather, and what expressions may read; frame-independent."""
        guides = None if keys is None else keys.guides

        def make() -> dict[str, Any]:
            count = len(bed.places.ids)
            spacing = smoothed(bed.ground.spacing.astype(np.float64)[:, None], bed.ground.near, 2)[:, 0]
            fields: dict[str, Any] = {
                "id": bed.places.ids, "tract": bed.tract, "age": bed.age, "spacing": spacing,
                "length": coat.overlap * spacing, "lift": np.full(count, STANDING), "turn": np.zeros(count),
            }
            if mesh.uvs is not None:
                fields["u"], fields["v"] = bed.roots.uvs[:, 0], bed.roots.uvs[:, 1]
            if binding is not None and guides is not None:
                scalars = interpolate(key_shapes(guides).scalars, binding)
                fields["lift"], fields["length"] = scalars[:, 0], scalars[:, 1]
                # a key that follows the body turns with it; only what it turns beyond that is a curl
                fields["turn"] = scalars[:, 2] + bend_of[:, 1] * scalars[:, 1] * 0.75
                fields["turn"] = np.where(np.abs(fields["turn"]) < 0.05, 0.0, fields["turn"])
                given = coat.key_attributes
                if given is not None and len(given.names):
                    table = attributes_of_keys(guides, given, given.values.mean(axis=0))
                    mixed = interpolate(table, binding)
                    fields.update({name: mixed[:, k] for k, name in enumerate(given.names)})
            return fields

        points = None if guides is None else guides.points
        found: dict[str, Any] = self._remember(
            "fields", make, bed, binding, points, coat.key_attributes, coat.overlap, directions
        )
        return found

    def _own(
        self, coat: FeatherCoat, fields: dict[str, Any], frame: float, mesh: Mesh, keys: Groom | None, bed: Bed
    ) -> NDArray[np.float32]:
        """Vanes of all feathers in their own frames, at length 1."""
        worn = load_bird(coat.preset).feathers
        table = np.tile(worn_values(coat, worn["body"])[: len(SHAPE_COLUMNS)], (len(bed.places.ids), 1))
        for number, tract in enumerate(coat.tracts):
            if tract.part in worn:  # a tract called as a part of the bird wears what that part wears
                table[bed.tract == number + 1] = worn_values(coat, worn[tract.part])[: len(SHAPE_COLUMNS)]
        for name, column in SHAPE_COLUMNS.items():
            if name in fields:
                table[:, column] = fields[name]
        for item in coat.attributes:
            if item.name in SHAPE_COLUMNS and not for_all(item):
                table[:, SHAPE_COLUMNS[item.name]] = self._evaluated(item.value, fields, frame, mesh, keys, bed)
        table[:, SHAPE_COLUMNS["shaftLength"]] = 1.0
        width = self._number(coat, "width", fields, frame, mesh, keys, bed)
        for name in SIZED[1:]:
            table[:, SHAPE_COLUMNS[name]] *= width
        known = self._memory.get("vanes")
        if known is not None and known[0][0].shape == table.shape:
            before, vanes = known[0][0], known[1]
            differ = np.flatnonzero((before != table).any(axis=1))
            if not len(differ):
                return vanes
            if len(differ) < len(table) // 2:
                vanes = vanes.copy()
                vanes[differ] = vane_grids(table[differ], ROWS, COLUMNS, self._evaluator.workers.ranges)
                self._memory["vanes"] = ((table,), vanes)
                return vanes
        vanes = vane_grids(table, ROWS, COLUMNS, self._evaluator.workers.ranges)
        self._memory["vanes"] = ((table,), vanes)
        return vanes

    def _number(
        self, coat: FeatherCoat, name: str, fields: dict[str, Any], frame: float, mesh: Mesh, keys: Groom | None,
        bed: Bed,
    ) -> Any:
        """A value of the coat at a frame, for every feather."""
        value: Value = getattr(coat, name)
        known = self._columns(value, fields, mesh, keys, bed)
        return evaluate_within(value, FEATHER_FIELDS[name], frame, known)

    def _evaluated(
        self, value: Value, fields: dict[str, Any], frame: float, mesh: Mesh, keys: Groom | None, bed: Bed
    ) -> NDArray[np.float64]:
        """A value that is none of the coat's own fields, for every feather."""
        return values.evaluate(value, frame, self._columns(value, fields, mesh, keys, bed))

    def _columns(
        self, value: Value, fields: dict[str, Any], mesh: Mesh, keys: Groom | None, bed: Bed
    ) -> dict[str, Any]:
        """The fields, and the maps a value reads."""
        skin = skin_at_rest(mesh, self._evaluator)
        maps: tuple[Map, ...] = () if keys is None else keys.maps
        known = dict(fields)
        for read in names_used(value) - known.keys() - {"frame"}:
            item = next((one for one in maps if one.name == read), None)
            if item is not None:
                known[read] = sample_map(item, mesh, skin.triangles, bed.places.triangle, bed.places.barycentric)
        return known

    def _laid(
        self, coat: FeatherCoat, bed: Bed, layered: Layered, base: Base, skin: Skin, frame: float
    ) -> Laid:
        density = np.broadcast_to(
            values.evaluate(coat.density, frame, base.fields), len(bed.places.ids)
        )
        shown = rand(bed.places.ids, seed_of(coat) + 401) < density
        return Laid(bed.places.ids, shown, layered, base.feathers, bed, skin, base.fields)


def _clear(
    feathers: Feathers, poses: NDArray[np.float64], skin: Skin, workers: Workers
) -> NDArray[np.float32]:
    vanes = pose_vanes(feathers.own, poses, feathers.roots, feathers.frames, ranges=workers.ranges)
    return clearances(vanes, poses[:, LENGTH], skin, workers)


def _same(a: Any, b: Any) -> bool:
    return a is b or (isinstance(a, int | float | str) and type(a) is type(b) and a == b)


LOOKS = tuple(
    name for name in FeatherCoat.__struct_fields__
    if name not in ("id", "name", "proxies", "wings", "density", "layered", "hidden", "locked")
)


def _looks(coat: FeatherCoat) -> tuple[Any, ...]:
    """What of a coat the feathers before settling come from."""
    return tuple(getattr(coat, name) for name in LOOKS)


def moves(value: Value) -> bool:
    """True when a value depends on the frame."""
    return isinstance(value.base, Curve) or (isinstance(value.base, Formula) and "frame" in names_used(value))


def moving(coat: FeatherCoat) -> bool:
    """True when anything of a coat depends on the frame by itself."""
    given = [item.value for item in coat.attributes] + [getattr(coat, name) for name in FEATHER_VALUES]
    return any(moves(value) for value in given) or wings_move(coat.wings)


def _unlayered(feathers: Feathers, poses: NDArray[np.float64], ranges: Any) -> Layered:
    vanes = pose_vanes(feathers.own, poses, feathers.roots, feathers.frames, ranges=ranges)
    none = np.zeros(0, np.int32)
    return Layered(poses, vanes, vane_boxes(vanes, ranges), none, none)


def _ordered(bed: Bed, frames: NDArray[np.float32], ranges: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    sides = smoothed(roll_sides(frames)[:, None], bed.ground.near, 3, ranges)[:, 0]
    return growth_order(bed.positions, frames, bed.ground.near, sides), sides
