"""Small documents for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from core.camera import Camera
from core.curve import Curve, Key
from core.document import Document, MeshObject, with_feathers, with_groom
from core.feather.coat.coat import AttributeValue, FeatherCoat, KeyAttributes, Placement, Proxy, Stroke, Tract
from core.feather.coat.wing import Anchor, Wing, WingOffset, WingRow
from core.groom.groom import Coat, Groom, Map
from core.groom.guides import Guides
from core.image.plate import Plate
from core.match.outline import Mask
from core.match.track import TrackSettings, drawn_plane, keyed_track
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.record import freeze
from core.value import Value, constant, formula
from core.workspace import Workspace


def grid_mesh(side: int) -> Mesh:
    """A square of side x side quads in the plane y = 0, with UVs."""
    n = side + 1
    x, z = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    first = (np.arange(side)[:, None] * n + np.arange(side)).ravel()
    corners = np.stack([first, first + n, first + n + 1, first + 1], axis=1).ravel().astype(np.int32)
    points = np.stack([x.ravel(), np.zeros(n * n), z.ravel()], axis=1).astype(np.float32)
    return Mesh(
        points=points, counts=np.full(side * side, 4, np.int32), corners=corners,
        uvs=points[corners][:, [0, 2]].copy(), parts=np.zeros(side * side, np.int32), part_names=("sheet",),
    )


def guides_on(mesh: Mesh, count: int, points: int = 4, seed: int = 0) -> Guides:
    """Straight guides at random places of the faces of a grid mesh."""
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, len(mesh.counts), count).astype(np.int32)
    weights = rng.dirichlet([1.0, 1.0, 1.0], count).astype(np.float32)
    corners = np.tile(np.array([0, 1, 2], np.int32), (count, 1))
    vertices = mesh.corners[mesh.starts[faces][:, None] + corners]
    root = np.einsum("nk,nkc->nc", weights, mesh.points[vertices])
    along = np.linspace(0.0, 0.1, points, dtype=np.float32)
    curves = root[:, None, :] + along[None, :, None] * np.array([0.0, 1.0, 0.0], np.float32)
    roots = Roots(
        faces=faces, corners=corners, weights=weights, uvs=root[:, [0, 2]].astype(np.float32),
        frames=np.tile(np.eye(3, dtype=np.float32)[[0, 2, 1]], (count, 1, 1)),
    )
    return Guides(
        ids=np.arange(count, dtype=np.int32), roots=roots, points=curves.astype(np.float32),
        hold=np.zeros((count, points), np.float32), selected=np.zeros(count, np.bool_),
        frozen=np.zeros(count, np.bool_), next_id=count,
    )


def small_document(guides: int = 12, side: int = 3, points: int = 4, seed: int = 0) -> Document:
    """One mesh and one groom with a map."""
    mesh = grid_mesh(side)
    density = np.linspace(0.0, 1.0, len(mesh.points), dtype=np.float32)
    groom = Groom(
        id=1, name="coat", mesh_id=7, guides=guides_on(mesh, guides, points, seed),
        coat=Coat(count=1000, density_map="density"), maps=(Map(name="density", values=density),),
    )
    return Document(meshes=(MeshObject(id=7, name="sheet", mesh=mesh),), grooms=(groom,))


def small_workspace() -> Workspace:
    """A workspace with one of everything."""
    camera = Camera(world_from_camera=np.eye(4))
    return Workspace(frame=1012.5, cameras=(camera,), panels=("history",), tool="comb", params={"radius": 0.25})


def animated_document() -> Document:
    """The small document with a coat whose values are of every kind: what the baselines of the formats hold."""
    document = small_document()
    groom = document.grooms[0]
    keys = (
        Key(frame=1001.0, value=0.1), Key(frame=1010.0, value=0.6, leave="free", leave_handle=(2.0, 0.1)),
        Key(frame=1030.0, value=0.2, arrive="aligned", leave="aligned", arrive_handle=(-3.0, 0.1),
            leave_handle=(3.0, -0.1)),
    )
    coat = groom.coat.replace(
        density=formula("clamp(0.5 + u, 0, 1)"), length=constant(1.25, "density"), clump=Value(base=Curve(keys=keys)),
        frizz=Value(base=Curve(keys=keys, before="cycle", after="linear"), map="density"),
        width_root=formula("1e-4 * (1 + rand(id, 7))", "density"), length_variation=constant(0.3),
    )
    return feathered(matched(with_groom(document, groom.replace(coat=coat))))


def feathered(document: Document) -> Document:
    """The document with a coat of feathers that has one of everything, its keys the guides of the first groom."""
    groom = document.grooms[0]
    frames, shaft = np.array([1001.0, 1010.0], np.float32), np.linspace(0.0, 0.1, 4, dtype=np.float32)
    shafts = np.stack([np.outer(shaft, direction) for direction in ((0.0, 1.0, 0.2), (0.3, 1.0, 0.4))])
    line = np.array([[0.1, 0.0, 0.1], [0.9, 0.0, 0.9]], np.float32)
    coat = FeatherCoat(
        id=1, name="plumage", mesh_id=groom.mesh_id, keys_id=groom.id,
        placements=(
            Placement(kind="rows", count=40, density_map="density"),
            Placement(kind="hand", count=2, hand=groom.guides.roots.take(np.arange(2))),
            Placement(kind="even", count=20, tract="spine"),
        ),
        tracts=(Tract(name="spine", line=line, width=0.3),), strokes=(Stroke(points=line),),
        attributes=(AttributeValue(name="shaftTwist", value=formula("0.2 * sin(frame) * age")),),
        key_attributes=KeyAttributes(
            ids=np.array([0, 3], np.int32), names=("vaneWidthLeft",), values=np.array([[0.1], [0.2]], np.float32)),
        proxies=(Proxy(
            id=3, frames=frames, rest=shafts[0].astype(np.float32), shafts=shafts.astype(np.float32),
            rolls=np.zeros(2, np.float32)),),
        ruffle=formula("0.1 * rand(id, 3)"), length=constant(1.1, "density"), wings=(small_wing(),),
    )
    return with_feathers(document, coat)


def small_wing() -> Wing:
    """A wing of two rows on two anchors of four vertices each, its second feather animated by hand."""
    anchors = tuple(Anchor(joint=name, vertices=np.arange(4, dtype=np.int32)) for name in ("body", "hand"))
    ones = np.ones(2, np.float32)
    places = np.array([[0.2, 0.1, 0.2], [0.8, 0.1, 0.3]], np.float32)
    rows = tuple(
        WingRow(
            id=k, name=part, part=part, count=3, anchors=np.array([0, 1], np.int32), places=places,
            normals=np.array([[0.0, 1.0, 0.0]] * 2, np.float32), shares=np.array([0.0, 1.0], np.float32),
            lengths=0.3 * ones / (k + 1), widths=ones, height=0.01 * k, length=formula("0.5 + 0.5 * open"),
            offsets=(WingOffset(number=2, spread=formula("0.1 * sin(frame)")),))
        for k, part in enumerate(("primaries", "primary coverts")))
    return Wing(
        id=0, name="left", kind="wing", anchors=anchors, rows=rows, inner=0, outer=1,
        inner_direction=(0.0, 0.0, -1.0), outer_direction=(1.0, 0.0, -0.2))


def matched(document: Document) -> Document:
    """The document with a plate, and a track, a plane and a mask on it."""
    square = np.array([[10.0, 10.0], [50.0, 12.0], [48.0, 40.0], [9.0, 38.0]])
    track = keyed_track(1, "nose", np.array([[1001.0, 20.5, 30.25], [1010.0, 22.0, 31.0]]), 1)
    return document.replace(  # type: ignore[no-any-return]
        plates=(Plate(id=1, name="shot", path="plates/shot.####.exr", first=1001, last=1020, width=64, height=48),),
        tracks=(track.replace(settings=TrackSettings(pattern=31), offset=(4.0, -2.0), shape=square - 25.0),),
        planes=(drawn_plane(1, "wall", 1001, square, 1),),
        masks=(Mask(id=1, name="hand", frames=np.array([1001, 1010], np.int32), points=np.stack((square, square + 3)),
                    plate_id=1, smooth=True),),
    )  # fmt: skip


def stroked(document: Document, seed: int, share: float = 0.3) -> Document:
    """The document after a made-up stroke: a share of the guides of its first groom moved."""
    rng = np.random.default_rng(seed)
    groom = document.grooms[0]
    points = groom.guides.points.copy()
    rows = rng.permutation(len(points))[: max(1, int(share * len(points)))]
    points[rows, 1:] += rng.normal(0.0, 0.01, points[rows, 1:].shape).astype(np.float32)
    moved: Any = groom.replace(guides=groom.guides.replace(points=freeze(points)))
    return document.replace(grooms=(moved, *document.grooms[1:]))  # type: ignore[no-any-return]
