"""The demo of feathers: the project's own bird, bare to be dressed, or dressed as a goldfinch."""

from __future__ import annotations

import numpy as np

from core.curve import Curve, Key
from core.demo.bird import demo_bird
from core.document import Document, MeshObject, with_feathers, with_groom
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat, Tract
from core.feather.coat.dress import dress_feathers
from core.groom.dress import Stage, no_stages
from core.record import freeze
from core.value import Value, constant

FEATHERS = 5000
# lines on the skin, metres, and widths
_CAP = [(0.0, 0.0985, 0.0470), (0.0, 0.1030, 0.0385)]
_BACK = [(0.0, 0.0875, 0.0120), (0.0, 0.0795, 0.0000), (0.0, 0.0670, -0.0200)]
_TAIL_FAN = {1001: 0.75, 1014: 0.75, 1021: 1.5, 1029: 1.4, 1040: 0.75}


def bare_bird_document() -> Document:
    """The demo bird with its rig and its clip, without a feather."""
    bird = demo_bird()
    clip = bird.rig.clip
    assert clip is not None  # it is made with one
    return Document(
        first_frame=int(clip.start), last_frame=int(clip.end), fps=clip.frames_per_second,
        meshes=(MeshObject(id=1, name="bird", mesh=bird.mesh, rig=bird.rig),))


def bird_document(evaluator: Evaluator, count: int = FEATHERS, stage: Stage = no_stages) -> Document:
    """The demo bird dressed as a goldfinch: `count` feathers of the skin, those of wings and tail, cap and back."""
    with stage("load"):
        document = bare_bird_document()
        item = document.meshes[0]
    with stage("dress"):
        dressed = dress_feathers(item.mesh, evaluator, count, "goldfinch", mesh_id=item.id, rig=item.rig)
    coat: FeatherCoat = dressed.coat.replace(
        width=constant(1.15),
        tracts=(_tract("cap", _CAP, 0.014), _tract("back", _BACK, 0.016)),
        wings=tuple(
            wing.replace(fan=_keyed(_TAIL_FAN)) if wing.kind == "tail" else wing for wing in dressed.coat.wings))
    return with_feathers(with_groom(document, dressed.keys), coat)


def _tract(name: str, line: list[tuple[float, float, float]], width: float) -> Tract:
    return Tract(name=name, line=freeze(np.array(line, np.float32)), width=width)


def _keyed(keys: dict[int, float]) -> Value:
    return Value(base=Curve(keys=tuple(Key(frame=float(f), value=v) for f, v in keys.items())))
