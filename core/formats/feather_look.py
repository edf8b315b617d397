"""The look of a feather as materials of the trade: UsdPreviewSurface, and MaterialX in USD and in a file of its own.

MaterialX 1.38: ``standard_surface``, thin walled, so that its subsurface is the light that shines through a vane.
"""

from __future__ import annotations

import xml.etree.ElementTree as xml
from pathlib import Path
from typing import Any

from core.feather.look import FeatherLook

SHADER = "ND_standard_surface_surfaceshader"
Input = tuple[str, str, Any]


def _inputs(look: FeatherLook) -> list[Input]:
    """Inputs of ``standard_surface``: name, MaterialX type, value."""
    return [
        ("base", "float", 1.0), ("base_color", "color3", look.color), ("specular", "float", look.gloss),
        ("specular_roughness", "float", look.roughness), ("specular_anisotropy", "float", look.anisotropy),
        ("subsurface", "float", look.transmission), ("subsurface_color", "color3", look.color),
        ("thin_walled", "boolean", True),
    ]  # fmt: skip


def write_mtlx(path: str | Path, look: FeatherLook) -> None:
    """Write the look as a MaterialX document with one material, ``feather``."""
    root = xml.Element("materialx", version="1.38", colorspace="lin_rec709")
    surface = xml.SubElement(root, "standard_surface", name="surface", type="surfaceshader")
    for name, kind, value in _inputs(look):
        xml.SubElement(surface, "input", name=name, type=kind, value=_written(value))
    material = xml.SubElement(root, "surfacematerial", name="feather", type="material")
    xml.SubElement(material, "input", name="surfaceshader", type="surfaceshader", nodename="surface")
    xml.indent(root)
    xml.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def usd_material(stage: Any, path: str, look: FeatherLook) -> Any:
    """Define a material on a stage of OpenUSD that says the look to renderers of both kinds."""
    from pxr import Gf, Sdf, UsdShade

    types = Sdf.ValueTypeNames
    kinds = {"float": types.Float, "color3": types.Color3f, "boolean": types.Bool}
    material = UsdShade.Material.Define(stage, path)
    preview = [("diffuseColor", "color3", look.color), ("roughness", "float", look.roughness)]
    for target, name, shader, inputs in (
        ("", "surface", "UsdPreviewSurface", preview), ("mtlx", "mtlx_surface", SHADER, _inputs(look)),
    ):
        surface = UsdShade.Shader.Define(stage, f"{path}/{name}")
        surface.CreateIdAttr(shader)
        color = UsdShade.Shader.Define(stage, f"{path}/{name}_color")  # the feather's own, the look's where it has none
        color.CreateIdAttr("ND_geompropvalue_color3" if target else "UsdPrimvarReader_float3")
        asked, fallback = ("geomprop", "default") if target else ("varname", "fallback")
        color.CreateInput(asked, types.String).Set("displayColor")
        kind_of = types.Color3f if target else types.Float3
        color.CreateInput(fallback, kind_of).Set(Gf.Vec3f(*look.color))
        read = color.CreateOutput("out" if target else "result", kind_of)
        for given, kind, value in inputs:
            told = surface.CreateInput(given, kinds[kind])
            told.Set(Gf.Vec3f(*value) if isinstance(value, tuple) else value)
            if kind == "color3":
                told.ConnectToSource(read)
        made = surface.CreateOutput("surface" if not target else "out", types.Token)
        output = material.CreateSurfaceOutput(target) if target else material.CreateSurfaceOutput()
        output.ConnectToSource(made)
    return material


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return ", ".join(f"{number:.6g}" for number in value) if isinstance(value, tuple) else f"{value:.6g}"
