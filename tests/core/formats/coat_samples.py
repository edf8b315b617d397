"""A small coat with every column filled, for the tests of the curve formats."""

from __future__ import annotations

import numpy as np

from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh

COLUMNS = Strands.__struct_fields__


def make_strands(rng, strands, children, least=2, most=9):
    counts = rng.integers(least, most + 1, strands).astype(np.int32)
    total = int(counts.sum())
    return Strands(
        counts=counts,
        points=rng.normal(0, 0.3, (total, 3)).astype(np.float32),
        widths=rng.uniform(1e-5, 2e-4, total).astype(np.float32),
        ids=rng.permutation(10 * strands)[:strands].astype(np.int32),
        root_uvs=rng.random((strands, 2), np.float32),
        colors=rng.random((total, 3), np.float32),
        guide_ids=rng.integers(0, 50, (strands, 3)).astype(np.int32) if children else None,
        guide_weights=rng.random((strands, 3), np.float32) if children else None,
    )


def make_groom(seed=1, guides=5, children=40, name="winter coat"):
    rng = np.random.default_rng(seed)
    return GroomStrands(
        name=name, guides=make_strands(rng, guides, False), children=make_strands(rng, children, True)
    )


def make_mesh():
    """A box of 1 x 1 x 2 (volume 2, faces turned outwards) in two parts, with UVs."""
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 2)], np.float32)
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32)
    return Mesh(
        points=points, counts=np.full(6, 4, np.int32), corners=faces.reshape(-1),
        uvs=np.random.default_rng(2).random((24, 2), np.float32),
        parts=np.array([0, 0, 0, 1, 1, 1], np.int32), part_names=("body", "tail"),
    )  # fmt: skip


def differing_columns(ours, theirs, but=()):
    """Names of the columns that are not the same to the bit."""
    found = []
    for name in COLUMNS:
        a, b = getattr(ours, name), getattr(theirs, name)
        if name not in but and ((a is None) != (b is None) or (a is not None and not np.array_equal(a, b))):
            found.append(name)
    return found
