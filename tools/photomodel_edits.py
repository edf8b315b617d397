"""Edits of models from photographs: pure functions from documents to documents, for a hand, a macro and a script."""

from __future__ import annotations

from typing import Any

import numpy as np

from core.document import Document, free_id, with_mesh
from core.errors import UserError
from core.image.plate import Plate
from core.image.plate_view import plate_size
from core.match.photomodel.guide import next_photo
from core.match.photomodel.records import (
    Known,
    ModelCircle,
    ModelLine,
    Part,
    Photo,
    Photomodel,
    Picked,
    WorldFrame,
)
from tools.document_edits import add_mesh

MOST = 64  # photographs that are taken into a new model by themselves
NO_MODEL = "There is no model of photographs yet; pick a point first."
# how many points in hand a constraint or a part needs, and how many at most
OF_KNOWN = {"distance": (2, 2), "equal": (4, 4), "right": (4, 4), "parallel": (4, 4), "plane": (4, 999),
            "line": (3, 999), "symmetric": (4, 999)}
OF_PARTS = {"polygon": (3, 999), "box": (3, 4), "extrude": (0, 999), "lathe": (4, 999), "mirror": (2, 3),
            "bridge": (0, 0)}


def model_of(document: Document) -> Photomodel | None:
    """The model that is worked on: the last that is not hidden."""
    return next((model for model in reversed(document.photomodels) if not model.hidden), None)


def working_model(models: tuple[Photomodel, ...]) -> Photomodel:
    """The model that tools change, or a new one; UserError for a locked one."""
    found = next((model for model in reversed(models) if not model.hidden), None)
    if found is None:
        number = free_id(models)
        return Photomodel(id=number, name=f"model_{number:02d}")
    if found.locked:
        raise UserError(f"{found.name} is locked; unlock it to pick in its photographs.")
    return found


def with_model(models: tuple[Photomodel, ...], model: Photomodel) -> tuple[Photomodel, ...]:
    """The models with this one in place of that of its id, or at the end."""
    if any(have.id == model.id for have in models):
        return tuple(model if have.id == model.id else have for have in models)
    return (*models, model)


def photo_of(model: Photomodel, plate_id: int, frame: int) -> Photo | None:
    """The photograph that is a frame of a plate, as files count."""
    return next((photo for photo in model.photos if (photo.plate_id, photo.frame) == (plate_id, frame)), None)


def focal_px(plate: Plate) -> float | None:
    """The focal length in pixels as the file or the artist says it, or None."""
    if plate.focal_mm is None or plate.film_back is None:
        return None
    return plate.focal_mm * plate.width / plate.film_back.width


def with_photo(model: Photomodel, plate: Plate, frame: int) -> tuple[Photomodel, Photo]:
    """The model with a frame of a plate among its photographs, and that photograph."""
    found = photo_of(model, plate.id, frame)
    if found is not None and (found.focal_px is not None or focal_px(plate) is None):
        return model, found
    if found is not None:  # somebody has said it since
        told: Photo = found.replace(focal_px=focal_px(plate))
        return model.replace(photos=tuple(told if one.id == told.id else one for one in model.photos)), told
    width, height = plate_size(plate)
    name = plate.name if plate.first == plate.last else f"{plate.name} {frame}"
    alike = next((p.camera for p in model.photos if (p.plate_id, p.width, p.height) == (plate.id, width, height)), None)
    made = Photo(
        id=free_id(model.photos), name=name[:255], width=width, height=height, plate_id=plate.id, frame=frame,
        camera=alike or 1, focal_px=focal_px(plate))
    return model.replace(photos=(*model.photos, made)), made


def take_photographs(document: Document) -> Document:
    """The document whose model has every frame of every plate that is no movie among its photographs."""
    model = working_model(document.photomodels)
    for plate in document.plates:
        if not plate.movie and len(plate.frames) <= MOST:
            for frame in plate.frames:
                if frame not in plate.missing:
                    model, _ = with_photo(model, plate, frame)
    if len(model.photos) > 4 * MOST:
        raise UserError(f"A model takes {4 * MOST} photographs at most; open fewer of them.")
    if not model.photos:
        raise UserError(f"There are no photographs: open stills, or a plate of {MOST} frames at most.")
    return put_model(document, model)


def put_model(document: Document, model: Photomodel) -> Document:
    """The document with a model in place of that of its id, or added."""
    changed: Document = document.replace(photomodels=with_model(document.photomodels, model))
    return changed


def walk(document: Document, plate_id: int, frame: int, way: int) -> Photo:
    """The photograph to look at next: forward with a point in hand that one in which it should be picked next,
    otherwise the next of the model, the first after the last."""
    model = _model(document)
    if not model.photos:
        raise UserError("The model has no photographs yet; take them in first.")
    here = photo_of(model, plate_id, frame)
    active = active_point(model)
    if way > 0 and active is not None and here is not None and here.id in model.points[active].picks.photo:
        after = next_photo(model, model.points[active].id)
        if after is not None:
            return next(photo for photo in model.photos if photo.id == after)
    at = model.photos.index(here) if here is not None else -max(way, 0)
    return model.photos[(at + way) % len(model.photos)]


def active_point(model: Photomodel) -> int | None:
    """The row of the active point."""
    rows = {point.id: row for row, point in enumerate(model.points)}
    return next((rows[id_] for id_ in reversed(model.selection) if id_ in rows), None)


def points_in_hand(model: Photomodel) -> tuple[int, ...]:
    """Ids of the selected points in the order of selection."""
    there = {point.id for point in model.points}
    return tuple(id_ for id_ in model.selection if id_ in there)


def select_points(document: Document, ids: tuple[int, ...]) -> Document:
    """The document with just these points of the model in hand, the last one active."""
    return put_model(document, _model(document).replace(selection=tuple(dict.fromkeys(ids))))


def select_next_point(document: Document, plate_id: int, frame: int) -> Document:
    """The document with the next point in hand that is not picked in a photograph, the first after the last."""
    model = _model(document)
    photo = photo_of(model, plate_id, frame)
    here = -1 if photo is None else photo.id
    active = active_point(model)
    first = 0 if active is None else active + 1
    for point in (*model.points[first:], *model.points[:first]):
        if here not in point.picks.photo:
            return put_model(document, model.replace(selection=(point.id,)))
    raise UserError("Every point is picked in this photograph; go on to the next one.")


def model_to_scene(document: Document) -> Document:
    """The document with what is built as a mesh of the scene, in place of the mesh of the model's name without coat."""
    from core.match.photomodel.build import built

    model = _model(document)
    mesh = built(model)
    grown = {groom.mesh_id for groom in document.grooms}
    for item in document.meshes:
        if item.name == model.name and item.rig is None and item.id not in grown and not item.locked:
            return with_mesh(document, item.replace(mesh=mesh, mask=None, surface=None))
    return add_mesh(document, mesh, model.name)


def add_known(document: Document, kind: str, value: tuple[float, ...] = ()) -> Document:
    """The document with something known of the points in hand, in their order; see ``solve.constraints.KINDS``."""
    model, points = _in_hand(document, OF_KNOWN[kind], kind)
    if kind == "symmetric" and len(points) % 2:
        raise UserError("Symmetry needs pairs: select a point, its mirror image, the next point, and so on.")
    if kind == "distance" and not (len(value) == 1 and 1e-9 <= value[0] <= 1e9):
        raise UserError("The distance must be a length above 0, in metres.")
    return _solved_again(document, model.replace(known=(*model.known, Known(kind=kind, points=points, value=value))))


def forget_known(document: Document) -> Document:
    """The document without what is known of the points in hand: all that speaks of no other point."""
    model, points = _in_hand(document, (1, 999), "what is known")
    rest = tuple(one for one in model.known if not set(one.points) <= set(points))
    if len(rest) == len(model.known):
        raise UserError("Nothing is known of these points alone; select all points of what shall be forgotten.")
    return _solved_again(document, model.replace(known=rest))


def set_world(document: Document, what: str, length: float = 1.0) -> Document:
    """The document whose model has its origin, axis, plane or distance at the points in hand: a similarity."""
    counts = {"origin": (1, 1), "axis": (2, 2), "plane": (3, 999), "distance": (2, 2)}
    model, points = _in_hand(document, counts[what], f"the {what}")
    told: dict[str, Any] = {what: points[0] if what == "origin" else points}
    if what == "plane" and model.frame.origin is None:
        told["origin"] = points[0]  # at the height of the ground, at least
    if what == "distance":
        if not 1e-9 <= length <= 1e9:
            raise UserError("The distance must be a length above 0, in metres.")
        told["length"] = length
    return _solved_again(document, model.replace(frame=model.frame.replace(**told)))


def add_part(document: Document, kind: str, value: tuple[float, ...] = ()) -> Document:
    """The document with a part built on the points in hand; what parts are built upon are the last ones.

    An extrusion without points in hand goes on from the last part, a mirror image is that of the last part, a bridge
    goes between the last two. No point is in hand afterwards.
    """
    from core.match.photomodel.build import built

    model, points = _in_hand(document, OF_PARTS[kind], f"a {kind}")
    needed = {"mirror": 1, "bridge": 2, "extrude": 0 if points else 1}.get(kind, 0)
    if len(model.parts) < needed:
        lacking = "two parts" if needed == 2 else "a part"
        raise UserError(f"A {kind} is made of {lacking}; make a polygon or a box first.")
    if kind == "box" and len(points) == 4:
        value = ()
    number = free_id(model.parts)
    part = Part(id=number, name=f"{kind}_{number:02d}", kind=kind, points=() if kind == "bridge" else points,
                parts=tuple(part.id for part in model.parts[len(model.parts) - needed:]), value=value)
    made = model.replace(parts=(*model.parts, part), selection=())
    built(made)  # refuses in words what cannot be built
    return put_model(document, made)


def delete_last_part(document: Document) -> Document:
    """The document without the part that was built last."""
    model = _model(document)
    if not model.parts:
        raise UserError(f"Nothing is built in {model.name} yet.")
    return put_model(document, model.replace(parts=model.parts[:-1]))


def delete_points(document: Document) -> Document:
    """The document without the points in hand, and without what is known of them and built on them."""
    model, points = _in_hand(document, (1, 999), "deleting")
    gone = set(points)

    def free(ids: tuple[int, ...] | None) -> bool:
        return ids is None or not gone & set(ids)

    parts: list[Part] = []
    for part in model.parts:
        if free(part.points) and set(part.parts) <= {one.id for one in parts}:
            parts.append(part)
    frame = model.frame
    frame = WorldFrame(
        origin=None if frame.origin in gone else frame.origin, axis=frame.axis if free(frame.axis) else None,
        plane=frame.plane if free(frame.plane) else None, distance=frame.distance if free(frame.distance) else None,
        length=frame.length)
    return put_model(document, model.replace(
        points=tuple(point for point in model.points if point.id not in gone), selection=(),
        lines=tuple(line for line in model.lines if free(line.points)),
        circles=tuple(circle.replace(points=tuple(i for i in circle.points if i not in gone))
                      for circle in model.circles),
        known=tuple(known for known in model.known if free(known.points)), frame=frame, parts=tuple(parts)))


def remove_pick(document: Document, plate_id: int, frame: int) -> Document:
    """The document without the picks of the points in hand in one photograph."""
    model, points = _in_hand(document, (1, 999), "this")
    photo = photo_of(model, plate_id, frame)
    if photo is None:
        raise UserError("This frame is no photograph of the model.")
    changed = tuple(
        point.replace(picks=_without(point.picks, photo.id)) if point.id in points else point
        for point in model.points)
    return _solved_again(document, model.replace(points=changed))


def set_focal(document: Document, *, find: bool) -> Document:
    """The document whose model looks for the focal length of its photographs too, or keeps it."""
    model = _model(document)
    lacking = next((photo.name for photo in model.photos if photo.focal_px is None and not find), None)
    if lacking is not None:
        raise UserError(f"Nobody knows the focal length of {lacking}; solve first, or set it in the panel Plates.")
    return put_model(document, model.replace(photos=tuple(photo.replace(find_focal=find) for photo in model.photos)))


def with_line(model: Photomodel, points: tuple[int, int]) -> tuple[Photomodel, ModelLine]:
    """The model with a line between two points, and that line."""
    found = next((line for line in model.lines if set(line.points) == set(points)), None)
    if found is not None:
        return model, found
    number = free_id(model.lines)
    line = ModelLine(id=number, name=f"edge_{number:02d}", points=points)
    return model.replace(lines=(*model.lines, line)), line


def with_circle(model: Photomodel, circle_id: int | None) -> tuple[Photomodel, ModelCircle]:
    """The model with a circle of an id, or a new one, and that circle."""
    found = next((circle for circle in model.circles if circle.id == circle_id), None)
    if found is not None:
        return model, found
    number = free_id(model.circles)
    circle = ModelCircle(id=number, name=f"circle_{number:02d}")
    return model.replace(circles=(*model.circles, circle)), circle


def _without(picks: Picked, photo: int) -> Picked:
    keep = picks.photo != photo
    return Picked(photo=np.ascontiguousarray(picks.photo[keep]), xy=np.ascontiguousarray(picks.xy[keep]))


def _model(document: Document) -> Photomodel:
    model = model_of(document)
    if model is None:
        raise UserError(NO_MODEL)
    if model.locked:
        raise UserError(f"{model.name} is locked; unlock it first.")
    return model


def _in_hand(document: Document, counts: tuple[int, int], what: str) -> tuple[Photomodel, tuple[int, ...]]:
    """The model and the points in hand, as many as `counts` allows."""
    model = _model(document)
    points = points_in_hand(model)
    least, most = counts
    if len(points) < least or (most and len(points) > most):
        number = f"{least}" if least == most else f"{least} or more" if most == 999 else f"{least} to {most}"
        raise UserError(f"Select {number} points for {what} with Pick point; Shift adds, their order counts.")
    return model, points


def _solved_again(document: Document, model: Photomodel) -> Document:
    """The document with a model, solved again from where it is when it was solved; UserError when nothing fits."""
    from core.match.photomodel.solve import is_solved, solved

    return put_model(document, solved(model).model if is_solved(model) else model)
