"""What Blender sees in a curve file. Runs with Blender's own Python, never with ours:

    PEERS_PYTHON blender_curves.py FILE OUT.npz

Imports FILE (USD or Alembic) with default settings and writes, for every curves object, its counts, its points
in world space (Blender is Z up, metres) and its widths there (twice Blender's radius), and the scene's unit scale.
"""

from __future__ import annotations

import sys

import bpy
import numpy as np


def main(path: str, out: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    importer = bpy.ops.wm.alembic_import if path.endswith(".abc") else bpy.ops.wm.usd_import
    importer(filepath=path)
    bpy.context.view_layer.update()
    found = {"scale_length": np.array(bpy.context.scene.unit_settings.scale_length)}
    for item in bpy.data.objects:
        if item.type != "CURVES":
            continue
        curves = item.data
        points = np.empty(3 * len(curves.points), np.float32)
        curves.attributes["position"].data.foreach_get("vector", points)
        world = np.array(item.matrix_world, np.float64)
        found[f"{item.name}.points"] = points.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
        firsts = np.empty(len(curves.curves), np.int32)
        curves.curves.foreach_get("first_point_index", firsts)
        found[f"{item.name}.counts"] = np.diff(np.append(firsts, len(curves.points)))
        radii = np.empty(len(curves.points), np.float32)
        curves.attributes["radius"].data.foreach_get("value", radii)
        found[f"{item.name}.widths"] = 2 * radii * abs(np.linalg.det(world[:3, :3])) ** (1 / 3)
    np.savez(out, **found)


main(*sys.argv[1:])
