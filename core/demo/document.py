"""The demo: the project's own animal, groomed."""

from __future__ import annotations

from core.demo.creature import demo_creature
from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.groom.dress import Stage, dress, no_stages
from core.groom.style import load_style


def demo_document(evaluator: Evaluator, hairs: int = 120_000, guides: int = 3000, stage: Stage = no_stages) -> Document:
    """The demo animal with its rig, its painted maps and a first coat of exactly `hairs` hairs."""
    with stage("load"):
        creature = demo_creature()
    groom = dress(
        creature.mesh, load_style("fur"), evaluator, guides, hairs, maps=creature.maps, density_map="density",
        length_map="length", name="coat", stage=stage,
    )
    clip = creature.rig.clip
    first, last = (1001, 1048) if clip is None else (int(clip.start), int(clip.start) + len(clip.translations) - 1)
    return Document(
        first_frame=first, last_frame=last, fps=24.0,
        meshes=(MeshObject(id=1, name="animal", mesh=creature.mesh, rig=creature.rig),), grooms=(groom,),
    )
