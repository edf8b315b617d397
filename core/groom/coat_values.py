"""What the values of a coat come to for each of its hairs at one frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.children import Children, Number, Shape, Traits
from core.groom.groom import COAT_FIELDS, COAT_VALUES, Groom
from core.groom.maps import sample_map
from core.groom.reach import presence
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin
from core.random import rand
from core.value import ValueFault, evaluate_within, names_used


def set_coat(
    children: Children, groom: Groom, mesh: Mesh, rest: Skin, frame: float, evaluator: Evaluator
) -> None:
    """Write the coat at a frame into ``children.length`` and ``children.traits``. Evaluate all children next.

    What is the same for all hairs stays one number; only what an expression or a map makes different is a column.

    Parameters
    ----------
    groom : its guides are those the children are bound to. rest : the skin of `mesh` at rest, where maps are read.

    Raises
    ------
    UserError
        A value cannot be evaluated; the sentence names the field.
    """
    numbers = _numbers(children, groom, mesh, rest, frame)
    coat = groom.coat
    # keyed on the id: a hair keeps its length whatever the density and however many others there are
    factor = numbers["length"] * (1.0 - numbers["length_variation"] * rand(children.ids, coat.seed + 101))
    item = None if coat.length_map is None else groom.map(coat.length_map)
    if item is not None:
        factor = factor * sample_map(item, mesh, rest.triangles, children.triangle, children.barycentric())
    children.length = np.ascontiguousarray(factor, np.float32)
    density = numbers["density"]
    left = presence(children, groom.guides, mesh, rest, coat.reach, evaluator) if coat.reach > 0.0 else None
    if left is not None:
        density = np.asarray(density * left, np.float32)
    children.traits = Traits(
        Shape(numbers["clump"], numbers["frizz"], coat.seed), density, numbers["width_root"],
        numbers["width_tip"],
    )


def _numbers(children: Children, groom: Groom, mesh: Mesh, rest: Skin, frame: float) -> dict[str, Number]:
    """Every value of the coat by the name of its field, in the order of the rows of children."""
    fields: dict[str, NDArray[np.generic]] = {}
    numbers: dict[str, Number] = {}
    for name in COAT_VALUES:
        value, known = getattr(groom.coat, name), COAT_FIELDS[name]
        try:
            for read in names_used(value) - fields.keys() - {"frame"}:
                fields[read] = _column(read, children, groom, mesh, rest)
        except UserError as error:
            raise ValueFault(known.label, error) from None
        numbers[name] = evaluate_within(value, known, frame, fields)
    return numbers


def _column(name: str, children: Children, groom: Groom, mesh: Mesh, rest: Skin) -> NDArray[np.generic]:
    """What the expressions of a coat call `name`, (N,)."""
    if name == "id":
        return children.ids
    if name in ("u", "v"):
        uvs = children.root_uvs()
        if uvs is None:
            raise UserError(f"{name} needs UVs and this mesh has none; paint a map per vertex or unwrap the mesh.")
        return uvs[:, "uv".index(name)]
    item = groom.map(name)
    if item is None:
        raise UserError(f"There is no map named {name!r}; paint or load it, or choose another map.")
    return sample_map(item, mesh, rest.triangles, children.triangle, children.barycentric())
