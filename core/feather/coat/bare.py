"""Where a bird has no feathers of the skin: beak, eyes and feet by the names of its parts, and the arms of wings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.feather.coat.posing import LENGTH
from core.feather.coat.wing import Wing
from core.feather.coat.wing_pose import lay_wings
from core.groom.groom import Map
from core.mesh.mesh import Mesh
from core.pose.rig import Rig
from core.record import freeze

BARE = ("eye", "beak", "bill", "feet", "foot", "claw", "toe", "tongue")  # words in the names of parts
AROUND_EYES = 1.35  # radii of an eye that stay free around it
ARM = 0.4  # share of forearm and hand in a vertex from which the wing's own rows cover it
ALONG = np.linspace(0.12, 0.75, 6)  # of a covert, where it covers the skin
REACH = 0.06  # of the longest feather of the wings: skin so near below a covert has no feathers of its own
NAME = "feathered"  # of the map


def _below(mesh: Mesh, wings: tuple[Wing, ...]) -> NDArray[np.bool_]:
    """Which vertices (V,) lie close below coverts at rest, where a feather would have to come up through them."""
    laid = lay_wings(wings, mesh.points, mesh.points, 0.0)
    coverts = np.flatnonzero(np.char.find(laid.parts, "covert") >= 0)
    if not len(coverts):
        return np.zeros(len(mesh.points), np.bool_)
    steps = laid.poses[coverts, LENGTH, None, None] * ALONG[None, :, None] * laid.frames[coverts, None, 1]
    shafts = (laid.roots[coverts, None] + steps).reshape(-1, 3)
    away, which = cKDTree(shafts).query(mesh.points)
    up = laid.frames[coverts[which // len(ALONG)], 2].astype(np.float64)
    under = np.einsum("vc,vc->v", shafts[which] - mesh.points, up) > 0.0
    return np.asarray(under & (away < REACH * laid.poses[:, LENGTH].max()))


def feathered_map(mesh: Mesh, rig: Rig, wings: tuple[Wing, ...]) -> Map | None:
    """Where feathers stand, 1 or 0 for each vertex; None where nothing of a mesh is known to be bare."""
    bare = np.zeros(len(mesh.points), np.bool_)
    points = mesh.points.astype(np.float64)
    for number, name in enumerate(mesh.part_names):
        if not any(word in name.lower() for word in BARE):
            continue
        mine = np.repeat(mesh.parts == number, mesh.counts)
        own = np.unique(mesh.corners[mine])
        bare[own] = True
        if "eye" in name.lower():
            for side in (own[points[own, 0] > 0.0], own[points[own, 0] <= 0.0]):
                if len(side):
                    middle = points[side].mean(axis=0)
                    radius = np.linalg.norm(points[side] - middle, axis=1).max()
                    bare |= np.linalg.norm(points - middle, axis=1) < AROUND_EYES * radius
    arms = {anchor.joint for wing in wings if wing.kind == "wing" for anchor in wing.anchors[2:]}
    joints = [k for k, name in enumerate(rig.skeleton.names) if name in arms]
    bare |= np.where(np.isin(rig.skin.joints, joints), rig.skin.weights, 0.0).sum(axis=1) > ARM
    bare |= _below(mesh, wings)
    if not bare.any():
        return None
    return Map(name=NAME, values=freeze((~bare).astype(np.float32)))
