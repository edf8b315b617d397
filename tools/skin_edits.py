"""Edits of skin weights, locked joints and the mask of a mesh. Pure functions for ``Session.edit`` and for scripts.

Every sculpt stands when weights change below it: its layers are extracted anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from core.document import Document, MeshObject, find_mesh, with_mesh
from core.errors import UserError
from core.mesh.edges import edge_vertices
from core.pose import weights
from core.pose.edit_layers import refresh
from core.pose.mirror_pose import mirror_of_rig
from core.pose.rig import Rig
from core.pose.sculpt.mask import blur_mask, grown_mask, invert_mask, shrunk_mask
from core.pose.sculpt.ring import whole_surface
from core.pose.sculpt.surface import sculpt_surface
from core.pose.skeleton import SkinWeights
from core.record import freeze
from tools.pose_edits import check_joints, rigged

MaskEdit = Literal["clear", "invert", "grow", "shrink", "blur"]


def set_skin(document: Document, mesh_id: int, skin: SkinWeights) -> Document:
    """The document with other skin weights of a mesh; what is sculpted stays where it is."""
    item, rig = rigged(document, mesh_id)
    if _same(skin, rig.skin):
        return document
    changed: MeshObject = item.replace(rig=rig.replace(skin=skin))
    if item.correctives is not None:
        made = refresh(item.mesh.points, rig.replace(skin=skin), item.correctives)
        changed = changed.replace(correctives=made.correctives)
    return with_mesh(document, changed)


def mirror_weights(document: Document, mesh_id: int, source: Literal["+X", "-X"] = "+X") -> Document:
    """The document with the weights of one side of the mesh at rest on the other; joints find theirs by name or place.

    Raises
    ------
    UserError
        No vertex has a partner on the other side.
    """
    item, rig = _skinned(document, mesh_id)
    side: Literal["positive", "negative"] = "positive" if source == "+X" else "negative"
    points = item.mesh.points
    skin, alone = weights.mirrored(rig.skin, points, mirror_of_rig(rig).partners, source=side)
    sign = 1.0 if source == "+X" else -1.0
    if len(alone) and len(alone) == int((sign * points[:, 0] < 0.0).sum()):
        raise UserError(f"{item.name} is not symmetric across X = 0; no vertex has a partner to take weights from.")
    return set_skin(document, mesh_id, _with_locked(rig, item, skin))


def smooth_weights(document: Document, mesh_id: int, amount: float = 0.5, passes: int = 1,
                   joint: str | None = None) -> Document:
    """The document with weights evened out between neighbours; of one joint, or of all when None."""
    item, rig = _skinned(document, mesh_id)
    check_joints(rig, () if joint is None else (joint,))
    edges, skin = edge_vertices(item.mesh), rig.skin
    amounts = np.full(len(skin.joints), amount)
    active = None if joint is None else rig.skeleton.names.index(joint)
    for _ in range(passes):
        skin = weights.smoothed(skin, edges, amounts, _locked(rig, item), active)
    return set_skin(document, mesh_id, skin)


def normalise_weights(document: Document, mesh_id: int) -> Document:
    """The document with weights that sum to 1 at every vertex as exactly as single precision can, each joint once."""
    item, rig = _skinned(document, mesh_id)
    skin = weights.normalized_weights(rig.skin, rig.skin.joints, rig.skin.weights, _locked(rig, item))
    return set_skin(document, mesh_id, skin)


def limit_influences(document: Document, mesh_id: int, influences: int = 4) -> Document:
    """The document with at most so many joints at each vertex, the strongest and those that are locked."""
    item, rig = _skinned(document, mesh_id)
    return set_skin(document, mesh_id, weights.limited(rig.skin, influences, _locked(rig, item)))


def prune_weights(document: Document, mesh_id: int, least: float = 0.01) -> Document:
    """The document without weights below `least`, what they had shared out among the others."""
    item, rig = _skinned(document, mesh_id)
    return set_skin(document, mesh_id, weights.pruned(rig.skin, least, _locked(rig, item)))


def lock_joints(document: Document, mesh_id: int, names: Sequence[str], locked: bool = True) -> Document:
    """The document with the weights of joints locked, or free again."""
    item, rig = rigged(document, mesh_id)
    check_joints(rig, names)
    now = set(item.locked_joints) | set(names) if locked else set(item.locked_joints) - set(names)
    wanted = tuple(name for name in rig.skeleton.names if name in now)
    return document if wanted == item.locked_joints else with_mesh(document, item.replace(locked_joints=wanted))


def edit_mask(document: Document, mesh_id: int, how: MaskEdit, times: int = 1) -> Document:
    """The document with the whole mask of a mesh cleared, inverted, or grown, shrunk or blurred so many times."""
    item = find_mesh(document, mesh_id)
    before = np.zeros(len(item.mesh.points), np.float32) if item.mask is None else item.mask
    mask = before
    if how == "clear":
        mask = np.zeros_like(before)
    elif how == "invert":
        mask = invert_mask(before)
    else:
        surface = sculpt_surface(item.mesh)
        ring = whole_surface(surface)
        for _ in range(times):
            mask = blur_mask(surface, mask, ring) if how == "blur" else (
                grown_mask if how == "grow" else shrunk_mask)(surface, mask)
    if np.array_equal(mask, before):
        return document
    return with_mesh(document, item.replace(mask=freeze(mask) if mask.any() else None))


def _skinned(document: Document, mesh_id: int) -> tuple[MeshObject, Rig]:
    item, rig = rigged(document, mesh_id)
    if not rig.skin.joints.shape[1]:
        raise UserError(f"No joint moves {item.name}; paint weights of a joint first.")
    return item, rig


def _locked(rig: Rig, item: MeshObject) -> list[int]:
    return [j for j, name in enumerate(rig.skeleton.names) if name in item.locked_joints]


def _with_locked(rig: Rig, item: MeshObject, skin: SkinWeights) -> SkinWeights:
    """The skin with the weights that locked joints had before, the others sharing what is left."""
    locked = _locked(rig, item)
    if not locked:
        return skin

    was, now = np.isin(rig.skin.joints, locked), np.isin(skin.joints, locked)
    free = np.where(now, np.float32(0), skin.weights)
    bare = free.sum(axis=1, keepdims=True) <= weights.TINY  # nothing but locked joints came: the vertex stays as it is
    kept = np.where(was | bare, rig.skin.weights, np.float32(0))
    return weights.normalized_weights(
        rig.skin, np.concatenate([rig.skin.joints, skin.joints], axis=1),
        np.concatenate([kept, np.where(bare, np.float32(0), free)], axis=1), locked)


def _same(one: SkinWeights, other: SkinWeights) -> bool:
    return np.array_equal(one.joints, other.joints) and np.array_equal(one.weights, other.weights)
