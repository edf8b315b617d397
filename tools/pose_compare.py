"""The switch between methods of interpolating sculpts, as an edit of the document."""

from __future__ import annotations

from core.document import Document, find_mesh, with_mesh
from core.errors import UserError
from core.pose.compare import Method, compared


def set_method(document: Document, mesh_id: int, method: Method) -> Document:
    """The document with all sculpts of a mesh taken by another method; the sculpts stay what they are.

    Raises
    ------
    UserError
        For "skin", which is only looked at; or a Refusal that names poses the method cannot tell apart.
    """
    item = find_mesh(document, mesh_id)
    if item.rig is None or item.correctives is None:
        return document
    if method == "skin":
        raise UserError("The skin alone can only be looked at: choose it in the view, or switch layers off.")
    return with_mesh(document, item.replace(correctives=compared(item.mesh.points, item.rig, item.correctives, method)))
