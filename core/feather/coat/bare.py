"""Where a bird has no feathers of the skin: beak, eyes and feet by the names of its parts, and the arms of wings."""

from __future__ import annotations

import numpy as np

from core.feather.coat.wing import Wing
from core.groom.groom import Map
from core.mesh.mesh import Mesh
from core.pose.rig import Rig
from core.record import freeze

BARE = ("eye", "beak", "bill", "feet", "foot", "claw", "toe", "tongue")  # words in the names of parts
AROUND_EYES = 1.8  # radii of an eye that stay free around it
ARM = 0.4  # share of forearm and hand in a vertex from which the wing's own rows cover it
STUB = 0.85  # share of the tail in a vertex from which its coverts cover it
NAME = "feathered"  # of the map


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
    for share, covered in (
        (ARM, {anchor.joint for wing in wings if wing.kind == "wing" for anchor in wing.anchors[2:]}),
        (STUB, {anchor.joint for wing in wings if wing.kind == "tail" for anchor in wing.anchors}),
    ):
        joints = [k for k, name in enumerate(rig.skeleton.names) if name in covered]
        bare |= np.where(np.isin(rig.skin.joints, joints), rig.skin.weights, 0.0).sum(axis=1) > share
    if not bare.any():
        return None
    return Map(name=NAME, values=freeze((~bare).astype(np.float32)))
