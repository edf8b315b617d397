"""Materials of feathers, read back by OpenUSD and, where it is installed, by MaterialX itself."""

from __future__ import annotations

import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np
from pxr import Usd, UsdShade

from core.feather.attributes import COLUMNS
from core.feather.look import FeatherLook, look_of
from core.feather.presets import preset_values
from core.formats.feather_look import SHADER, usd_material, write_mtlx

LOOK = FeatherLook((0.5, 0.25, 0.125), 0.4, 0.3, 0.8, 0.2)


def test_the_look_of_a_bird_is_its_colour() -> None:
    gold, owl = look_of(preset_values("goldfinch-breast")), look_of(preset_values("owl-primary"))
    assert gold.color[0] > gold.color[1] > 2.0 * gold.color[2]  # yellow
    assert max(owl.color) < 3.0 * min(owl.color)  # brown and grey
    values = preset_values("contour").copy()
    values[[COLUMNS["vaneRoughnessLeft"], COLUMNS["vaneRoughnessRight"]]] = 0.2, 0.4
    np.testing.assert_allclose(look_of(values).roughness, 0.3, rtol=1e-6)


def test_a_stage_says_the_look_to_both_kinds_of_renderers() -> None:
    stage = Usd.Stage.CreateInMemory()
    material = UsdShade.Material(usd_material(stage, "/Looks/feather", LOOK))
    plain = material.ComputeSurfaceSource()[0]
    assert plain.GetIdAttr().Get() == "UsdPreviewSurface"
    assert tuple(plain.GetInput("diffuseColor").Get()) == LOOK.color
    known = material.ComputeSurfaceSource("mtlx")[0]
    assert known.GetIdAttr().Get() == SHADER
    assert tuple(known.GetInput("base_color").Get()) == LOOK.color
    np.testing.assert_allclose(known.GetInput("specular_anisotropy").Get(), 0.8, rtol=1e-6)


def test_a_materialx_document_has_one_material_whose_shader_is_there(tmp_path: Path) -> None:
    write_mtlx(tmp_path / "look.mtlx", LOOK)
    root = xml.parse(tmp_path / "look.mtlx").getroot()
    (material,) = root.findall("surfacematerial")
    (link,) = material.findall("input")
    (surface,) = (node for node in root if node.get("name") == link.get("nodename"))
    given = {node.get("name"): node.get("value") for node in surface}
    assert given["base_color"] == "0.5, 0.25, 0.125"
    assert given["thin_walled"] == "true"
