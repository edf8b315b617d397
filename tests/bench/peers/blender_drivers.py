"""The posed surface Blender makes of a rig and our script of drivers. Runs with Blender's own Python, never with ours:

    PEERS_PYTHON blender_drivers.py RIG SCRIPT.py POSES.json OUT.npz

Imports RIG (.usdc, .glb) with default settings, selects its mesh, runs SCRIPT as Blender's text editor would, and at
every pose of POSES.json ({"joints": [names, parents first], "poses": [{"matrices": (J, 4, 4), "numbers": {...}}]};
matrices carry points from rest to the pose, in the space of the file) writes the vertices as Blender shows them, world
space, (P, V, 3).
"""

from __future__ import annotations

import json
import sys

import bpy
import numpy as np
from mathutils import Matrix


def main(rig: str, script: str, poses: str, out: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.use_scripts_auto_execute = True
    turn = Matrix()  # from the space of the file to that of the armature
    if rig.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=rig)
        turn = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
    else:
        bpy.ops.wm.usd_import(filepath=rig)
    mesh = next(item for item in bpy.data.objects if item.type == "MESH" and item.find_armature())
    bpy.context.view_layer.objects.active = mesh
    with open(script, encoding="utf-8") as file:
        exec(compile(file.read(), script, "exec"), {"__name__": "__main__"})
    with open(poses, encoding="utf-8") as file:
        said = json.load(file)
    seen = [shown(mesh, said["joints"], pose["matrices"], pose["numbers"], turn) for pose in said["poses"]]
    np.savez(out, points=np.array(seen))


def shown(mesh: bpy.types.Object, joints: list[str], matrices: list, numbers: dict, turn: Matrix) -> np.ndarray:
    armature = mesh.find_armature()
    posed = {}
    for name, matrix in zip(joints, matrices):
        bone = armature.pose.bones[name]
        rest = bone.bone.matrix_local
        posed[name] = turn @ Matrix(matrix) @ turn.inverted() @ rest
        bone.rotation_mode = "QUATERNION"
        above = posed[bone.parent.name] @ bone.parent.bone.matrix_local.inverted() if bone.parent else Matrix()
        bone.matrix_basis = rest.inverted() @ above.inverted() @ posed[name]
    for name, value in numbers.items():
        if name in mesh.data.shape_keys.key_blocks:
            mesh.data.shape_keys.key_blocks[name].value = value
        else:
            mesh[name] = value
    mesh.update_tag()
    armature.update_tag()
    bpy.context.view_layer.update()
    whole = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.empty(3 * len(whole.data.vertices), np.float32)
    whole.data.vertices.foreach_get("co", points)
    world = np.array(whole.matrix_world, np.float64)
    return points.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]


main(*sys.argv[1:])
