"""Which thing of the scene is meant, and how the view shows it; edits are in document_edits."""

from __future__ import annotations

from core.document import Document, MeshObject, find_groom, find_mesh
from core.workspace import Workspace


def active_mesh(document: Document, workspace: Workspace) -> MeshObject | None:
    """The mesh the artist is at: in the craft of posing the one that is posed, else the one under the groom that tools
    edit, else the first; None without meshes."""
    if workspace.craft == "pose":
        rigged = [item for item in document.meshes if item.rig is not None]
        if rigged:
            return next((item for item in rigged if item.id == workspace.mesh), rigged[0])
    if any(groom.id == workspace.groom for groom in document.grooms):
        return find_mesh(document, find_groom(document, workspace.groom or 0).mesh_id)
    if document.grooms:
        return find_mesh(document, document.grooms[0].mesh_id)
    return document.meshes[0] if document.meshes else None


def show_all(document: Document) -> Document:
    """The document with nothing hidden."""
    if not anything_hidden(document):
        return document
    return document.replace(
        meshes=tuple(m.replace(hidden=False) if m.hidden else m for m in document.meshes),
        grooms=tuple(g.replace(hidden=False) if g.hidden else g for g in document.grooms),
    )


def anything_hidden(document: Document) -> bool:
    """True when a mesh or a groom is hidden."""
    return any(m.hidden for m in document.meshes) or any(g.hidden for g in document.grooms)


def isolated(document: Document, workspace: Workspace) -> Workspace:
    """The workspace that shows only the mesh the artist is at, with its grooms; everything when it did already."""
    item, view = active_mesh(document, workspace), workspace.view
    alone = () if item is None or view.isolated == (item.id,) else (item.id,)
    result: Workspace = workspace.replace(view=view.replace(isolated=alone))
    return result


def ghosted(document: Document, workspace: Workspace) -> Workspace:
    """The workspace that shows the mesh the artist is at translucent; solid again when it was."""
    item, view = active_mesh(document, workspace), workspace.view
    if item is None:
        return workspace
    others = tuple(i for i in view.ghosted if i != item.id)
    result: Workspace = workspace.replace(
        view=view.replace(ghosted=others if item.id in view.ghosted else (*others, item.id)))
    return result


def stored_bookmark(workspace: Workspace, name: str) -> Workspace:
    """The workspace with the view's camera kept under a name; unchanged before there is a view."""
    if not workspace.cameras:
        return workspace
    result: Workspace = workspace.replace(bookmarks={**workspace.bookmarks, name: workspace.cameras[0]})
    return result
