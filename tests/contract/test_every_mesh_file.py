"""Every mesh file of the data set is read or refused in one sentence; every format gives back what it was given."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from core.errors import UserError
from core.formats.mesh_file import INSTEAD, READ_SUFFIXES, WRITE_SUFFIXES, mesh_info, read_mesh, write_mesh
from core.mesh.edges import is_closed
from core.mesh.mesh import Mesh
from core.mesh.triangulate import triangulate

DATA = Path(os.environ["FILOPLUME_DATA"]) if "FILOPLUME_DATA" in os.environ else None
KNOWN = (*READ_SUFFIXES, ".fbx", ".mesh", ".tfxmesh")
FILES = sorted(
    path.relative_to(DATA).as_posix()
    for folder in ("meshes", "hair", "animation")
    for path in (DATA / folder).rglob("*")
    if path.suffix.lower() in KNOWN
) if DATA else []  # fmt: skip
needs_data = pytest.mark.skipif(DATA is None, reason="FILOPLUME_DATA is not set")

# Files without polygons, or without all of their parts: they must be refused, all others must be read.
REFUSED = re.compile(
    r"\.fbx$|\.mesh$|\.tfxmesh$|/empty\.|_empty|_points|wireframe|roots|landmark_id|face_in_group_name"
    r"|_invalid\.usda$|mtl\.usda$|badSkel|openusd_curves_A|babylon|MissingBin|AllIndices|RecursiveNodes|BoxWithInfinites"
)
TEXTS = [name for name in FILES if re.search(r"\.(obj|off|stl|ply)$", name, re.IGNORECASE) and not REFUSED.search(name)]
# Counts of SOURCES.md, made with other readers (trimesh, pygltflib, usd-core): vertices and faces in the file.
COUNTS = {
    "cat-low-resolution.obj": (7949, 15894), "alligator.obj": (3208, 5981), "suzanne.obj": (507, 500),
    "penguin_control_mesh.obj": (201, 221), "spot_control_mesh.obj": (188, 180), "3holes.off": (3596, 7200),
    "horse_quad.obj": (2400, 2398), "camelhead.off": (11381, 22704), "busted.STL": (11634, 3878),
    "capsule.obj": (5252, 10200), "fuze.obj": (502, 1000), "jacked.obj": (8, 12), "negative_indices.obj": (8, 6),
    "polygonfaces.obj": (5, 1), "quadknot.obj": (1440, 1440), "rabbit.obj": (644, 678), "singlevn.obj": (4, 2),
    "soup.stl": (300, 100), "box_longline.obj": (8, 6), "box_without_lineending.obj": (8, 6),
    "concave_polygon.obj": (64, 1), "number_formats.obj": (15, 1), "spider.obj": (762, 1368),
    "box_UTF16BE.obj": (8, 6), "head_model.obj": (6918, 13832), "catmark_edgecorner_level3.obj": (7492, 7168),
    "SoC-ElephantWithMonochord.usdc": (1972, 2762), "Pyramid.usd": (20, 24), "geo.usda": (16, 16),
    "Bone_Anim.abc": (754, 752), "Fox.glb": (1728, 576), "MorphStressTest.gltf": (1528, 2412),
    "monkey.glb": (1966, 968),
}  # fmt: skip


@needs_data
def test_the_data_is_there():
    assert len(FILES) > 100
    assert COUNTS.keys() <= {Path(name).name for name in FILES}


@pytest.mark.skipif(DATA is not None, reason="the data is there")
def test_without_data_this_is_said():
    pytest.skip("FILOPLUME_DATA is not set")


@needs_data
@pytest.mark.parametrize("name", FILES)
def test_each_file_is_read_or_refused_in_one_sentence(name):
    path = DATA / name
    notes = []
    if REFUSED.search(name):
        with pytest.raises(UserError) as caught:
            read_mesh(path, say=notes.append)
        message = str(caught.value)
        assert path.name in message
        assert "\n" not in message
        assert message.endswith(".")
        return
    found = read_mesh(path, say=notes.append)
    mesh = found.mesh
    assert len(mesh.counts) > 0
    assert np.isfinite(mesh.points).all()
    assert mesh.corners.max() < len(mesh.points)
    assert (found.vertices, found.faces) == COUNTS.get(path.name, (found.vertices, found.faces))
    left_out = sum(found.problems.get(kind, 0) for kind in (
        "out_of_range_faces", "nonfinite_faces", "degenerate_faces", "duplicate_faces",
    ))  # fmt: skip
    assert len(mesh.counts) == found.faces - left_out
    assert found.closed == is_closed(mesh)
    assert len(triangulate(mesh).vertices) == (mesh.counts - 2).sum()
    assert tuple(notes) == found.notes
    assert found.unit_source == ("file" if path.suffix in (".glb", ".gltf") else found.unit_source)
    assert all("\n" not in note and path.name in note for note in notes)


@needs_data
@pytest.mark.parametrize("name", TEXTS)
def test_shapes_agree_with_trimesh(name):
    """Area and bounds of what trimesh reads (it drops faces without area and duplicates too)."""
    if "number_formats" in name or "UTF16" in name:
        pytest.skip("trimesh does not read this file")
    found = read_mesh(DATA / name)
    theirs = trimesh.load(DATA / name, force="mesh", process=False, skip_materials=True)
    mesh = found.mesh
    used = mesh.points[mesh.corners]
    np.testing.assert_allclose([used.min(0), used.max(0)], theirs.bounds, rtol=1e-5, atol=1e-6)
    p = mesh.points[triangulate(mesh).vertices].astype(float)
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2
    if found.problems.get("duplicate_faces") or (mesh.counts > 3).any():
        assert area <= theirs.area * (1 + 1e-4)  # theirs counts doubles, and cuts concave faces as fans
    else:
        assert area == pytest.approx(theirs.area, rel=1e-4)


def sample(seed=0):
    """A small mesh of triangles, quads and pentagons with seams in its UVs and two named parts."""
    rng = np.random.default_rng(seed)
    n = 7
    grid = np.arange(n * n).reshape(n, n)
    x, z = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    points = np.stack([x, np.sin(x) * np.cos(z), z], -1).reshape(-1, 3) + rng.uniform(-0.2, 0.2, (n * n, 3))
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], -1).reshape(-1, 4).tolist()
    faces = []
    for row, (a, b, c, d) in enumerate(quads):
        faces += [[a, b, c, d]] if row % 3 else [[a, b, c], [a, c, d]]
    boundary_a, boundary_b = grid[0, 0], grid[0, 1]
    points = np.concatenate([points, [points[boundary_a] + (-1, 0, 0.2), points[boundary_b] + (-1, 0, -0.2),
                                      (points[boundary_a] + points[boundary_b]) / 2 + (-1.6, 0, 0)]])  # fmt: skip
    faces.append([boundary_b, boundary_a, n * n, n * n + 2, n * n + 1])
    corners = np.concatenate(faces).astype(np.int32)
    return Mesh(
        points=(points * 0.37).astype(np.float32), counts=np.array([len(f) for f in faces], np.int32), corners=corners,
        # glTF counts v from the top; these survive 1 - v to the bit
        uvs=(rng.integers(-2048, 2048, (len(corners), 2)) / 1024).astype(np.float32),
        parts=(np.arange(len(faces)) >= len(faces) // 2).astype(np.int32), part_names=("left_ear", "right_ear"),
    )  # fmt: skip


def triangles_of(mesh):
    cut = triangulate(mesh)
    return mesh.replace(
        counts=np.full(len(cut.faces), 3, np.int32), corners=cut.vertices.reshape(-1), parts=mesh.parts[cut.faces],
        uvs=mesh.uvs[cut.corners.reshape(-1)],
    )  # fmt: skip


def corner_rows(mesh, with_uvs=True):
    """Each face as its corners (place, UV), beginning with the least: what must not change on the way."""
    rows = []
    for ring in np.split(np.arange(len(mesh.corners)), np.cumsum(mesh.counts)[:-1]):
        places = mesh.points[mesh.corners[ring]]
        corners = np.hstack([places, mesh.uvs[ring]] if with_uvs else [places]).tolist()
        at = corners.index(min(corners))
        rows.append(corners[at:] + corners[:at])
    return rows


KEEPS_PARTS = {".obj", ".glb", ".usd", ".usda", ".usdc", ".usdz", ".abc"}


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
@pytest.mark.parametrize("uvs", [True, False], ids=["uvs", "plain"])
def test_what_is_written_is_read_back(suffix, uvs, tmp_path):
    mesh = sample() if uvs else sample().replace(uvs=None)
    path = tmp_path / f"fox{suffix}"
    write_mesh(path, mesh)
    found = read_mesh(path)
    back = found.mesh
    if suffix == ".stl":  # triangles only
        cut = triangulate(mesh)
        theirs = back.points[back.corners].reshape(-1, 3, 3)
        np.testing.assert_array_equal(theirs, mesh.points[cut.vertices])
        assert len(back.points) == len(mesh.points)
        return
    keeps_uvs = uvs and suffix != ".off"  # OFF has room for one UV of a vertex
    assert (back.uvs is not None) == keeps_uvs
    ours, theirs = corner_rows(mesh, keeps_uvs), corner_rows(back, keeps_uvs)
    if suffix in (".glb", ".abc"):  # faces come back part by part
        assert sorted(ours) == sorted(theirs)
    else:
        assert ours == theirs
        np.testing.assert_array_equal(back.points, mesh.points)
    if suffix in KEEPS_PARTS:
        assert back.part_names == mesh.part_names
        assert np.bincount(back.parts).tolist() == np.bincount(mesh.parts).tolist()
    assert found.unit_source == ("file" if suffix == ".glb" or "usd" in suffix or suffix == ".abc" else "assumed")


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
def test_our_files_open_in_other_readers(suffix, tmp_path):
    mesh = triangles_of(sample()) if suffix in (".ply", ".off") else sample()  # theirs reads no mixed polygons there
    path = tmp_path / f"fox{suffix}"
    write_mesh(path, mesh)
    if "usd" in suffix:
        from pxr import Usd, UsdGeom, Vt

        stage = Usd.Stage.Open(str(path))
        assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
        prims = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
        assert len(prims) == 1
        made = UsdGeom.Mesh(prims[0])
        np.testing.assert_array_equal(np.array(made.GetPointsAttr().Get()), mesh.points)
        counts, corners = made.GetFaceVertexCountsAttr().Get(), made.GetFaceVertexIndicesAttr().Get()
        assert UsdGeom.Mesh.ValidateTopology(Vt.IntArray(corners), Vt.IntArray(counts), len(mesh.points))[0]
        subsets = UsdGeom.Subset.GetAllGeomSubsets(made)
        assert UsdGeom.Subset.ValidateSubsets(subsets, len(counts), UsdGeom.Tokens.partition)[0]
    elif suffix != ".abc":
        theirs = trimesh.load(path, force="mesh", process=False)
        np.testing.assert_allclose(theirs.bounds, [mesh.points.min(0), mesh.points.max(0)], rtol=1e-6)
        assert len(theirs.faces) == (mesh.counts - 2).sum()
        ours = trimesh.Trimesh(mesh.points, triangulate(mesh).vertices, process=False)
        assert theirs.area == pytest.approx(ours.area, rel=0.05)  # crooked quads may be cut the other way
        up = [tri.area_faces @ tri.face_normals for tri in (ours, theirs)]
        np.testing.assert_allclose(*up, atol=1e-4)  # the area vector depends on the outline alone


@pytest.mark.parametrize(("unit", "up", "factor"), [("cm", None, 0.01), ("in", "z", 0.0254), ("m", "y", 1.0)])
def test_unit_and_axis_of_files_that_do_not_say(unit, up, factor, tmp_path):
    (tmp_path / "t.obj").write_text("v 1 2 3\nv 4 5 6\nv 7 8 -9\nf 1 2 3\n")
    found = read_mesh(tmp_path / "t.obj", unit=unit, up=up)
    x, y, z = np.array([[1, 2, 3], [4, 5, 6], [7, 8, -9]]).T * factor
    expected = np.stack([x, z, -y] if up == "z" else [x, y, z], axis=1)
    np.testing.assert_allclose(found.mesh.points, expected, rtol=1e-6)
    assert found.unit_source == "given"
    assert any("--up" in note and "--unit" not in note for note in found.notes) == (up is None)


def test_what_a_usd_file_says_wins(tmp_path):
    (tmp_path / "t.usda").write_text("""#usda 1.0
( metersPerUnit = 0.01
  upAxis = "Z" )
def Xform "a"
{
    double3 xformOp:translate = (0, 0, 100)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "m"
    {
        uniform token orientation = "leftHanded"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (100, 0, 0), (0, 200, 0)]
    }
}
""")
    found = read_mesh(tmp_path / "t.usda", unit="m", up="y")
    np.testing.assert_allclose(found.mesh.points, [(0, 1, 0), (1, 1, 0), (0, 1, -2)], atol=1e-6)
    assert found.mesh.corners.tolist() == [2, 1, 0]  # left-handed, so turned over
    assert (found.unit_source, found.up, found.notes) == ("file", "z", ())


@pytest.mark.parametrize("name", [f"fox{suffix}" for suffix in INSTEAD] + ["fox.xyz", "fox", ".obj"])
def test_other_formats_are_refused_with_what_to_do(name, tmp_path):
    (tmp_path / name).write_bytes(b"content")
    with pytest.raises(UserError, match=r"export the mesh as|use \.obj"):
        read_mesh(tmp_path / name)


@pytest.mark.parametrize("bad", ["gone.obj", "folder.obj", "nul\0.obj", "x" * 300 + ".obj"])
def test_what_is_no_file_is_refused(bad, tmp_path):
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(UserError, match=r"\.obj|too long"):
        read_mesh(tmp_path / bad)


@needs_data
def test_info_of_the_cat():
    info = mesh_info(DATA / "meshes/odedstein_A/cat/cat-low-resolution.obj")
    assert (info["kind"], info["parts"], info["vertices"], info["faces"]) == ("mesh", 1, 7949, 15894)
    assert info["problems"] == {"missing_uvs": 15894}
    assert info["closed"]
