"""Correctives for Blender and Maya: a script that makes the shapes and drives them from the joints.

The weights of every layer are written out as plain arithmetic over the rotations of its joints: one program, printed
once as a Python function for Blender's drivers and once as a MEL expression for Maya. Neither needs a plug-in.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from core.document import MeshObject
from core.errors import UserError
from core.formats.corrective_shapes import CorrectiveShapes, corrective_shapes
from core.pose.kernels import SUPPORT
from core.pose.pose_space import Dof
from core.pose.rotation import FADE_FROM, polar_rotation
from core.pose.solve import Solved

Lines = list[tuple[str, str]]  # name, arithmetic over names before it: + - * / sqrt exp log pow min max


class Program(NamedTuple):
    """Arithmetic from inputs to weights.

    inputs : (name, control, part) with part "x" "y" "z" "w" of the rotation relative to rest, "tx" "ty" "tz" of the
        translation from rest, or "number". lines : assignments in order. outputs : the weight of each shape, by name.
    """

    inputs: tuple[tuple[str, str, str], ...]
    lines: Lines
    outputs: tuple[str, ...]


def program(found: CorrectiveShapes) -> Program:
    """The arithmetic of the weights of all corrective shapes.

    Raises
    ------
    UserError
        For plain correctives and for kernels from a table, which are not written out.
    """
    inputs: dict[tuple[str, str], str] = {}
    lines: Lines = []
    weights: dict[tuple[int, int], dict[int, str]] = {}
    outputs = []
    for shape in found.shapes:
        ready = found.layers[shape.layer]
        solved = ready.solved[shape.run]
        if solved is None or solved.settings.table:
            raise UserError(
                f"The layer {ready.layer.name!r} is a plain corrective or looks its kernel up in a table, which "
                "scripts for other programs cannot say; switch it to a computed pose space."
            )
        key = (shape.layer, id(solved))
        if key not in weights:
            known = np.flatnonzero(ready.layer.moved[:, ready.starts[shape.run]])
            named = _system(f"s{len(weights)}", solved, inputs, lines)
            weights[key] = dict(zip(known.tolist(), named, strict=True))
        outputs.append(weights[key][shape.sample])
    return Program(tuple((name, control, part) for (control, part), name in inputs.items()), lines, tuple(outputs))


def _system(prefix: str, solved: Solved, inputs: dict[tuple[str, str], str], lines: Lines) -> list[str]:
    """Append the arithmetic of one system; returns the names of the weights of its samples."""
    def put(name: str, formula: str) -> str:
        lines.append((f"{prefix}{name}", formula))
        return f"{prefix}{name}"

    places = [put(f"p{i}", formula) for i, formula in enumerate(_coordinates(prefix, solved.dofs, inputs, lines))]
    settings = solved.settings
    if settings.clamp:
        low, high = solved.centres.min(axis=0), solved.centres.max(axis=0)
        places = [put(f"q{i}", f"max({_n(low[i])}, min({_n(high[i])}, {p}))") for i, p in enumerate(places)]
    count = len(solved.centres)
    squared = []
    for c in range(count):
        parts = [f"pow(({p} - {_n(x)}) * {_n(s)}, 2.0)" for p, x, s in
                 zip(places, solved.centres[c], solved.scales[c], strict=True)]
        squared.append(put(f"r{c}", " + ".join(parts)))
    if solved.inverse is None:
        shares = [put(f"i{c}", f"1.0 / max({r}, 1e-200)") for c, r in enumerate(squared)]
        total = put("total", " + ".join(shares))
        return [put(f"w{c}", f"{shares[c]} / {total}") for c in range(solved.silent, count)]
    columns = [put(f"k{c}", _kernel(settings.kernel, r, solved.centres.shape[1])) for c, r in enumerate(squared)]
    if solved.plane is not None:
        plane = solved.plane
        columns.append(put("a", _n(plane.size)))
        for q in range(plane.across.shape[1]):
            parts = [f"({p} - {_n(m)}) * {_n(x * plane.size)}" for p, m, x in
                     zip(places, plane.middle, plane.across[:, q], strict=True)]
            columns.append(put(f"a{q}", " + ".join(parts)))
    needed = range(count) if settings.normalise != "none" else range(solved.silent, count)
    found = {
        c: put(f"w{c}", " + ".join(f"{k} * {_n(x)}" for k, x in zip(columns, solved.inverse[:, c], strict=True)))
        for c in needed
    }
    if settings.normalise == "above-one":
        total = put("total", f"max(1.0, {' + '.join(found.values())})")
    elif settings.normalise == "always":
        total = put("total", " + ".join(f"max({w}, 0.0 - {w})" for w in found.values()))
    else:
        return list(found.values())
    return [put(f"n{c}", f"{found[c]} / {total}") for c in range(solved.silent, count)]


def _coordinates(prefix: str, dofs: tuple[Dof, ...], inputs: dict[tuple[str, str], str], lines: Lines) -> list[str]:
    """Formulas of the coordinates, as ``core.pose.embedding.embed`` computes them."""
    out: list[str] = []
    for d, dof in enumerate(dofs):
        def read(part: str) -> str:
            return inputs.setdefault((dof.control, part), f"v{len(inputs)}")  # noqa: B023

        if dof.kind == "number":
            out.append(read("number"))
            continue
        if dof.kind == "translation":
            out += [read("tx"), read("ty"), read("tz")]
            continue
        x, y, z, w = (read(part) for part in "xyzw")
        axis, side = np.array(dof.axis), np.array(dof.side)
        if dof.kind != "twist":
            rows = (
                (f"1.0 - 2.0 * ({y}*{y} + {z}*{z})", f"2.0 * ({x}*{y} - {z}*{w})", f"2.0 * ({x}*{z} + {y}*{w})"),
                (f"2.0 * ({x}*{y} + {z}*{w})", f"1.0 - 2.0 * ({x}*{x} + {z}*{z})", f"2.0 * ({y}*{z} - {x}*{w})"),
                (f"2.0 * ({x}*{z} - {y}*{w})", f"2.0 * ({y}*{z} + {x}*{w})", f"1.0 - 2.0 * ({x}*{x} + {y}*{y})"),
            )
            turned = []
            for i, row in enumerate(rows):
                formula = " + ".join(f"({f}) * {_n(a)}" for f, a in zip(row, axis, strict=True))
                lines.append((f"{prefix}d{d}t{i}", formula))
                turned.append(f"{prefix}d{d}t{i}")
            for frame in (axis, side, np.cross(axis, side)):
                out.append(" + ".join(f"{t} * {_n(a)}" for t, a in zip(turned, frame, strict=True)))
        if dof.kind != "swing":
            at = f"{prefix}d{d}"
            lines += [
                (f"{at}a", f"{x} * {_n(axis[0])} + {y} * {_n(axis[1])} + {z} * {_n(axis[2])}"),
                (f"{at}s", f"max({w} * {w} + {at}a * {at}a, 1e-300)"),
                (f"{at}f", f"min(1.0, sqrt({at}s) * {_n(1.0 / FADE_FROM)})"),
                (f"{at}g", f"0.5 * {at}f * (3.0 - {at}f * {at}f) / {at}s"),
            ]
            out += [f"{at}g * ({w} * {w} - {at}a * {at}a)", f"{at}g * 2.0 * {w} * {at}a"]
    return out


def _kernel(name: str, r: str, dimensions: int) -> str:
    if name == "wendland":
        power = max(3, dimensions // 2 + 2) + 1
        near = f"min(sqrt({r}) / {_n(SUPPORT)}, 1.0)"
        return f"pow(1.0 - {near}, {power}.0) * ({power}.0 * {near} + 1.0)"
    return {
        "gaussian": f"exp(-0.5 * {r})", "thin-plate": f"0.5 * {r} * log(max({r}, 1e-300))",
        "multiquadric": f"sqrt(1.0 + {r})", "inverse-multiquadric": f"1.0 / sqrt(1.0 + {r})",
        "cubic": f"{r} * sqrt({r})", "linear": f"sqrt({r})",
    }[name]


def _n(value: float) -> str:
    """A number that reads back to the same float64, in brackets when it is below 0."""
    text = repr(float(value))
    return f"({text})" if value < 0.0 else text


def python_function(made: Program) -> str:
    """The program as a Python function ``weights(...)`` of its inputs, a tuple of the weights of the shapes."""
    names = ", ".join(name for name, _, _ in made.inputs)
    body = "".join(f"    {name} = {formula}\n" for name, formula in made.lines)
    return (
        f"def weights({names}):\n{body}    return ({', '.join(made.outputs)}{',' if made.outputs else ''})\n"
    )


def mel_assignments(made: Program) -> str:
    """The program as assignments of MEL, one a line; inputs and results are variables of the same names."""
    names = {*(name for name, _, _ in made.inputs), *(name for name, _ in made.lines)}

    def mel(formula: str) -> str:
        return re.sub(r"[A-Za-z_]\w*", lambda m: f"${m[0]}" if m[0] in names else m[0], formula)

    return "".join(f"float ${name} = {mel(formula)};\n" for name, formula in made.lines)


def write_blender(path: Path, item: MeshObject, fps: float) -> tuple[str, ...]:
    """Write a script for Blender's text editor; returns sentences about what it cannot say."""
    found, rig = corrective_shapes(item), item.rig
    if rig is None:
        raise UserError(f"{item.name} has no rig to write; give it a skeleton first.")
    made = program(found)
    shapes = [(s.name, s.vertices.tolist(), [[float(f"{x:.9g}") for x in row] for row in s.offsets.tolist()])
              for s in found.shapes]
    turn = polar_rotation(rig.skeleton.bind[:, :3, :3])
    joints = {
        name: {"turn": turn[j].tolist(), "place": rig.skeleton.bind[j, :3, 3].tolist(),
               "parent": np.eye(3).tolist() if rig.skeleton.parents[j] < 0
               else turn[rig.skeleton.parents[j]].tolist()}
        for j, name in enumerate(rig.skeleton.names)
    }
    path.write_text(BLENDER.format(
        name=item.name, vertices=len(item.mesh.points), joints=joints, inputs=made.inputs,
        rests={c.name: c.rest for c in rig.controls}, shapes=shapes, function=python_function(made),
        dual=rig.skinning != "linear",
    ), encoding="utf-8")
    if rig.skinning != "mixed":
        return found.notes
    return (*found.notes, f"{item.name} is skinned in two ways, which Blender is not: all of it keeps its volume.")


def write_maya(path: Path, item: MeshObject, fps: float) -> tuple[str, ...]:
    """Write a MEL script for a scene in centimetres; returns sentences about what it cannot say."""
    found, rig = corrective_shapes(item), item.rig
    if rig is None:
        raise UserError(f"{item.name} has no rig to write; give it a skeleton first.")
    made = program(found)
    places = dict(zip(rig.skeleton.names, rig.skeleton.rest[:, :3, 3].tolist(), strict=True))
    rests = {c.name: c.rest for c in rig.controls}
    reads: dict[str, list[str]] = {}
    numbers = sorted({control for _, control, part in made.inputs if part == "number"})
    for name, control, part in made.inputs:
        joint = _mel_name(control)
        if part == "number":
            reads.setdefault(control, []).append(f"float ${name} = filoplume.{joint};")
        elif part.startswith("t"):
            rest = _n(places[control]["xyz".index(part[1])])
            reads.setdefault(control, []).append(
                f"float ${name} = {joint}.translate{part[1].upper()} * 0.01 - {rest};")
        else:
            reads.setdefault(f"{control} ", []).append(f"float ${name} = {_EULER[part]};")
    lines: list[str] = []
    for control, read in reads.items():
        if control.endswith(" "):  # half angles of a joint, once
            joint = _mel_name(control[:-1])
            for axis in "XYZ":
                half = f"deg_to_rad({joint}.rotate{axis}) * 0.5"
                lines += [f"$s{axis} = sin({half});", f"$c{axis} = cos({half});"]
        lines += read
    declared = " ".join(f"float $s{axis}; float $c{axis};" for axis in "XYZ")
    body = declared + "\n" + "\n".join(lines) + "\n" + mel_assignments(made)
    targets = []
    for k, (shape, output) in enumerate(zip(found.shapes, made.outputs, strict=True)):
        where = f"($b + \".inputTarget[0].inputTargetGroup[{k}].inputTargetItem[6000]"
        points = " ".join(f"{x * 100:.9g} {y * 100:.9g} {z * 100:.9g} 1" for x, y, z in shape.offsets.tolist())
        vertices = " ".join(f'"vtx[{v}]"' for v in shape.vertices.tolist())
        targets.append(
            f'setAttr {where}.inputPointsTarget") -type "pointArray" {len(shape.vertices)} {points};\n'
            f'setAttr {where}.inputComponentsTarget") -type "componentList" {len(shape.vertices)} {vertices};\n'
            f'setAttr ($b + ".weight[{k}]") 0;\naliasAttr {json.dumps(_mel_name(shape.name))} ($b + ".weight[{k}]");\n')
        body += f"filoplumeShapes.weight[{k}] = ${output};\n"
    dials = "".join(
        f"addAttr -longName {_mel_name(n)} -attributeType double -defaultValue {rests[n]!r} -keyable true $dials;\n"
        for n in numbers)
    path.write_text(MAYA.format(
        name=item.name, vertices=len(item.mesh.points), dials=dials, targets="".join(targets), body=json.dumps(body)
    ), encoding="utf-8")
    if rig.skinning == "linear":
        return found.notes
    return (*found.notes, f"{item.name} is skinned with dual quaternions: set its skin cluster in Maya to them too.")


def _mel_name(name: str) -> str:
    """A name Maya allows, as its importers make it."""
    clean = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"_{clean}" if clean[:1].isdigit() else clean


# of a rotation about x, then y, then z by its half angles
_EULER = {
    "x": "$sX * $cY * $cZ - $cX * $sY * $sZ", "y": "$cX * $sY * $cZ + $sX * $cY * $sZ",
    "z": "$cX * $cY * $sZ - $sX * $sY * $cZ", "w": "$cX * $cY * $cZ + $sX * $sY * $sZ",
}

MAYA = """// Corrections of {name}: select its mesh ({vertices} vertices, centimetres) and source this file.
// Joints keep their rest in jointOrient and stand at rotate 0 when it is sourced, rotate order xyz.
string $mesh[] = `ls -selection`;
string $made[] = `blendShape -frontOfChain -name "filoplumeShapes" $mesh[0]`;
string $b = $made[0];
string $dials = `group -empty -name "filoplume"`;
{dials}{targets}expression -name "filoplumeDrivers" -string {body};
"""

BLENDER = """# Corrections of {name}: open in the text editor of Blender, select the mesh
# ({vertices} vertices) that its armature moves, and run. Run again after the file is opened.
from math import exp, log, sqrt
import bpy
from mathutils import Matrix, Vector

JOINTS = {joints}
INPUTS = {inputs}  # name, control, part
RESTS = {rests}
SHAPES = {shapes}  # name, vertices, metres


{function}

def main():
    mesh = bpy.context.object
    if len(mesh.data.vertices) != {vertices}:
        raise SystemExit("select the mesh with {vertices} vertices, imported without changing their order")
    armature = mesh.find_armature()
    for modifier in mesh.modifiers:
        if modifier.type == "ARMATURE":
            modifier.use_deform_preserve_volume = {dual}
    frames = frames_of(armature)
    if mesh.data.shape_keys is None:
        mesh.shape_key_add(name="Basis", from_mix=False)
    keys = mesh.data.shape_keys.key_blocks
    for name, vertices, moves in SHAPES:
        key = keys.get(name) or mesh.shape_key_add(name=name, from_mix=False)
        key.slider_min, key.slider_max = -10.0, 10.0
        for vertex, move in zip(vertices, moves):
            key.data[vertex].co = keys[0].data[vertex].co + frames[""] @ Vector(move)
    for control, rest in RESTS.items():
        if control not in mesh:
            mesh[control] = rest

    def weight(row, *values):
        return weights(*read(values, frames))[row]

    place = "filoplume_" + "".join(c if c.isalnum() else "_" for c in mesh.name)
    bpy.app.driver_namespace[place] = weight
    for row, (name, _, _) in enumerate(SHAPES):
        keys[name].driver_remove("value")
        driver = keys[name].driver_add("value").driver
        driver.type = "SCRIPTED"
        for variable, control, part in channels():
            made = driver.variables.new()
            made.name = variable
            if part == "number":
                made.targets[0].id, made.targets[0].data_path = mesh, '["' + control + '"]'
                continue
            made.type = "TRANSFORMS"
            made.targets[0].id, made.targets[0].bone_target = armature, control
            made.targets[0].transform_space, made.targets[0].rotation_mode = "LOCAL_SPACE", "QUATERNION"
            made.targets[0].transform_type = part
        driver.expression = place + "(" + ",".join([str(row), *(v for v, _, _ in channels())]) + ")"


def channels():
    out = []
    for control in dict.fromkeys(c for _, c, _ in INPUTS):
        mine = [p for _, c, p in INPUTS if c == control]
        parts = dict.fromkeys("t" if p[0] == "t" else p if p == "number" else "r" for p in mine)
        for part in parts:
            names = {{"t": ["LOC_X", "LOC_Y", "LOC_Z"], "r": ["ROT_X", "ROT_Y", "ROT_Z", "ROT_W"]}}.get(part, [part])
            out += [("u%d" % (len(out) + i), control, name) for i, name in enumerate(names)]
    return out


def read(values, frames):
    # from the axes of Blender's bones to those of the joints
    have = {{(control, name): value for (_, control, name), value in zip(channels(), values)}}
    out = []
    for _, control, part in INPUTS:
        if part == "number":
            out.append(have[control, "number"])
        elif part[0] == "t":
            moved = frames[control][1] @ Vector([have[control, "LOC_" + a] for a in "XYZ"])
            out.append(moved["xyz".index(part[1])])
        elif part == "w":
            out.append(have[control, "ROT_W"])
        else:
            turned = frames[control][0] @ Vector([have[control, "ROT_" + a] for a in "XYZ"])
            out.append(turned["xyz".index(part)])
    return out


def frames_of(armature):
    # importers may turn Y up into Z up: the turn that puts the joints where the bones are
    bones = armature.data.bones
    best = None
    for turn in (Matrix.Identity(3), Matrix(((1, 0, 0), (0, 0, -1), (0, 1, 0)))):
        off = sum((bones[n].head_local - turn @ Vector(j["place"])).length for n, j in JOINTS.items() if n in bones)
        if best is None or off < best[0]:
            best = (off, turn)
    turn = best[1]
    out = {{"": turn}}
    for name, joint in JOINTS.items():
        if name in bones:
            rest = bones[name].matrix_local.to_3x3().normalized()
            ours, parent = turn @ Matrix(joint["turn"]), turn @ Matrix(joint["parent"])
            out[name] = (ours.transposed() @ rest, parent.transposed() @ rest)
    return out


main()
"""
