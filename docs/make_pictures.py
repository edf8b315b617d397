"""Remakes every picture of the manual: ``make pictures``. The cat needs FILOPLUME_DATA."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np

from app.deliver import draw
from app.files import draw_file
from core.demo.document import demo_document
from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.formats.mesh_file import read_mesh
from core.formats.project import write_project
from core.groom.dress import dress
from core.groom.grow import grow
from core.groom.style import load_style

PICTURES = Path(__file__).parent / "pictures"
CAT = Path("meshes/odedstein_A/cat/cat-low-resolution.obj")  # Oded Stein's meshes, CC BY 4.0
STYLES = ("short", "fur", "long", "mane")


def main() -> None:
    PICTURES.mkdir(exist_ok=True)
    evaluator = Evaluator()
    document = demo_document(evaluator)
    children = {1: grow(document.grooms[0], document.meshes[0].mesh, evaluator)}
    draw(PICTURES / "demo.png", document, children, evaluator, (1200, 750))
    turned = PICTURES / "turned.filo"
    write_project(turned, document)
    draw_file(turned, PICTURES / "demo-1024.png", (1200, 750), "three-quarter", 1024, print)
    turned.unlink()
    data = os.environ.get("FILOPLUME_DATA")
    if not data:
        print("FILOPLUME_DATA is not set: the pictures of the cat stay as they are")
        return
    mesh = read_mesh(Path(data) / CAT, unit="m", up="y").mesh
    made = []
    for name in STYLES:
        groom = dress(mesh, load_style(name), evaluator, 5000, 150_000)
        document = Document(meshes=(MeshObject(id=1, name="cat", mesh=mesh),), grooms=(groom,))
        path = PICTURES / ("cat.png" if name == "fur" else f"cat-{name}.png")
        draw(path, document, {1: grow(groom, mesh, evaluator)}, evaluator, (1200, 750))
        made.append(cv2.imread(str(path))[:, 190:960])
        if name != "fur":
            path.unlink()
    small = [cv2.resize(image, None, fx=0.62, fy=0.62, interpolation=cv2.INTER_AREA) for image in made]
    cv2.imwrite(str(PICTURES / "styles.png"), np.hstack(small))


if __name__ == "__main__":
    main()
