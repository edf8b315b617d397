"""Bare instancing in Blender: one feather on every root by geometry nodes. Runs with Blender's own Python, never ours:

    PEERS_PYTHON blender_instances.py COAT.npz OUT.usdc

COAT.npz: vane (R, C, 3), roots (N, 3), turns (N, 3) Euler angles in radians, scales (N,). Prints one JSON object:
`place`, seconds from moved roots to evaluated instances, which Blender's window then draws; `build`, to the triangles
of all of them (Realize Instances), both the median of five; `write`, of the USD export; `count`, how many there are.
"""

from __future__ import annotations

import json
import sys
import time

import bpy
import numpy as np


def main(coat: str, out: str) -> None:
    given = np.load(coat)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rows, columns = given["vane"].shape[:2]
    at = np.arange(rows * columns).reshape(rows, columns)
    faces = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    feather = _object("feather", given["vane"].reshape(-1, 3), faces.tolist())
    feather.hide_set(True)
    coat_object = _object("roots", given["roots"], [])
    for name, kind, field in (("turn", "FLOAT_VECTOR", "vector"), ("size", "FLOAT", "value")):
        values = given["turns"] if name == "turn" else given["scales"]
        coat_object.data.attributes.new(name, kind, "POINT").data.foreach_set(field, values.astype(np.float32).ravel())
    tree = _nodes(feather)
    coat_object.modifiers.new("feathers", "NODES").node_group = tree
    place = _evaluated(coat_object)
    graph = bpy.context.evaluated_depsgraph_get()
    count = sum(1 for one in graph.object_instances if one.is_instance)
    start = time.perf_counter()
    bpy.ops.wm.usd_export(filepath=out, use_instancing=True)
    write = time.perf_counter() - start
    realize = tree.nodes.new("GeometryNodeRealizeInstances")
    end = next(link for link in tree.links if link.to_node.bl_idname == "NodeGroupOutput")
    source, target = end.from_socket, end.to_socket
    tree.links.new(source, realize.inputs[0])
    tree.links.new(realize.outputs[0], target)
    build = _evaluated(coat_object)
    made = len(coat_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices)
    if made != count * given["vane"][..., 0].size:
        raise RuntimeError(f"{made} vertices are not those of {count} feathers")
    print(json.dumps({"place": place, "build": build, "write": write, "count": count}))


def _evaluated(coat: bpy.types.Object) -> float:
    """The median of the seconds Blender takes to evaluate the coat after a root moved."""
    seconds = []
    for k in range(5):
        coat.data.vertices[0].co.x += 1e-6 * (k + 1)
        coat.data.update()
        start = time.perf_counter()
        bpy.context.view_layer.update()
        bpy.context.evaluated_depsgraph_get().update()
        seconds.append(time.perf_counter() - start)
    return sorted(seconds)[2]


def _object(name: str, points: np.ndarray, faces: list) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], faces)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(made)
    return made


def _nodes(feather: bpy.types.Object) -> bpy.types.NodeTree:
    tree = bpy.data.node_groups.new("feathers", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    entry, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    copies, source = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeObjectInfo")
    source.inputs["Object"].default_value = feather
    source.inputs["As Instance"].default_value = True
    tree.links.new(entry.outputs[0], copies.inputs["Points"])
    tree.links.new(source.outputs["Geometry"], copies.inputs["Instance"])
    for name, kind, socket in (("turn", "FLOAT_VECTOR", "Rotation"), ("size", "FLOAT", "Scale")):
        read = tree.nodes.new("GeometryNodeInputNamedAttribute")
        read.data_type = kind
        read.inputs["Name"].default_value = name
        tree.links.new(read.outputs["Attribute"], copies.inputs[socket])
    tree.links.new(copies.outputs["Instances"], end.inputs[0])
    return tree


main(*sys.argv[1:])
