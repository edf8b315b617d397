"""The document: what a preview, undo, a thousand strokes, saving, opening and recovering cost."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from core.document import Document, MeshObject, with_groom
from core.formats.journal import Journal
from core.formats.project import read_project, write_project
from core.formats.recovery import recover
from core.groom.groom import Groom
from core.history import History
from core.leaves import array_bytes, same_bits
from core.mesh.mesh import Mesh
from core.record import freeze
from core.workspace import Workspace
from tests.bench.bench import Row, median_ms
from tests.documents import grid_mesh, guides_on
from tools.session import Session

TITLE = "The document"
GUIDES, POINTS, SIDE, SHARE = 20_000, 16, 317, 0.05  # 317 x 317 quads, cut, are 200,978 triangles


def large_document() -> Document:
    """20,000 guides of 16 points on a mesh of 200,000 triangles."""
    mesh = _in_triangles(grid_mesh(SIDE))
    groom = Groom(id=1, name="coat", mesh_id=1, guides=guides_on(mesh, GUIDES, POINTS))
    return Document(meshes=(MeshObject(id=1, name="skin", mesh=mesh),), grooms=(groom,))


def _in_triangles(mesh: Mesh) -> Mesh:
    places = (4 * np.arange(len(mesh.counts))[:, None] + np.array([0, 1, 2, 0, 2, 3])).ravel()
    count = 2 * len(mesh.counts)
    assert mesh.uvs is not None
    return mesh.replace(
        counts=np.full(count, 3, np.int32), corners=mesh.corners[places], uvs=mesh.uvs[places],
        parts=np.zeros(count, np.int32),
    )


def dab(document: Document, rng: np.random.Generator) -> Document:
    """Twenty guides of a hundred moved, as far as the document is concerned: what a preview event makes."""
    groom = document.grooms[0]
    points = groom.guides.points.copy()
    points[rng.permutation(GUIDES)[: int(SHARE * GUIDES)], 1:] += np.float32(0.001)
    return with_groom(document, groom.replace(guides=groom.guides.replace(points=freeze(points))))


def _preview_ms(document: Document) -> float:
    """Whole copy, new records with their checks, hand-over to the session; the kernel that moves points is left out."""
    session = Session(document)

    def event() -> None:
        groom = session.document.grooms[0]
        points = groom.guides.points.copy()
        points[0, 1, 0] += np.float32(1e-4)
        session.preview(with_groom(session.document, groom.replace(guides=groom.guides.replace(points=freeze(points)))))

    cost = median_ms(event, runs=200, warm=20)
    session.close(discard=True)
    return cost


def run() -> list[Row]:
    """Rows of the table."""
    rng = np.random.default_rng(0)
    document = start = large_document()
    rows = [Row("document cost of one preview event, 20,000 guides", _preview_ms(document), "ms", 1.0)]

    history = History(document, budget=1 << 40)
    for i in range(1000):
        document = dab(document, rng)
        history.commit(f"Comb {i}", document)
    history.flush()
    megabytes = (history.bytes - array_bytes(start.meshes)) / 1e6
    rows.append(Row("1,000 strokes, 20,000 guides, history in memory", megabytes, "MB", 400.0))
    rows.append(Row("undo, 20,000 guides", median_ms(history.undo, runs=200, warm=25), "ms", 5.0))
    rows.append(Row("redo, 20,000 guides", median_ms(history.redo, runs=150, warm=25), "ms", 5.0))
    begin = time.perf_counter()
    assert same_bits(history.jump(0), start)
    rows.append(Row("back over all 1,000 strokes", 1e3 * (time.perf_counter() - begin), "ms"))
    history.close()

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.filo"
        size = "20,000 guides on a 200,000-triangle mesh"
        rows.append(Row(f"save {size}", median_ms(lambda: write_project(path, document)), "ms", 150.0))
        rows.append(Row(f"open {size}", median_ms(lambda: read_project(path)), "ms", 150.0))
        journal = Journal(Path(folder))
        waits = []
        for i in range(60):
            document = dab(document, rng)
            begin = time.perf_counter()
            number = journal.commit(document, Workspace(), f"Comb {i}")
            assert journal.flush() == number
            waits.append(1e3 * (time.perf_counter() - begin))
        found = recover(journal.folder, journal.token)
        assert found is not None
        assert same_bits(found.document, document)
        rows.append(Row("a stroke safe on disk after", float(np.median(waits)), "ms"))
        rows.append(Row(f"recover {size}", median_ms(lambda: recover(journal.folder, journal.token)), "ms", 150.0))
        journal.close(remove=True)
    return rows
