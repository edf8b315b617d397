import cv2
import numpy as np
import pytest
import trimesh

from core.errors import UserError
from core.match.photomodel.build import built
from core.match.photomodel.records import ModelPoint, Part, Photomodel
from core.match.photomodel.rows import seen_by
from core.match.photomodel.texture import textured
from tests.core.match.photomodel.scenes import HOUSE, photo

MODEL = Photomodel(id=1, name="m", points=tuple(
    ModelPoint(id=k + 1, name=f"p{k + 1}", place=tuple(map(float, place)))
    for k, place in enumerate([*HOUSE, (8, 0, 0), (8, 2, 0), (9, 0, 0), (8.5, 1, 0), (8, 2.5, 0)])
))
BOX = Part(id=1, name="box", kind="box", points=(1, 2, 4, 5))


def _made(*parts) -> trimesh.Trimesh:
    mesh = built(MODEL.replace(parts=parts))
    triangles = [
        (loop[0], loop[k], loop[k + 1]) for loop in np.split(mesh.corners, np.cumsum(mesh.counts)[:-1])
        for k in range(1, len(loop) - 1)
    ]
    return trimesh.Trimesh(mesh.points, triangles, process=False)


@pytest.mark.parametrize(
    ("parts", "volume"),
    [
        ((BOX,), 72.0),
        ((Part(id=1, name="b", kind="box", points=(1, 2, 4), value=(-3.0,)),), 72.0),
        ((Part(id=1, name="b", kind="box", points=(1, 2, 4), value=(3.0,)),), 72.0),
        ((Part(id=1, name="e", kind="extrude", points=(1, 2, 6, 9, 5), value=(6.0,)),), 90.0),
        ((Part(id=1, name="e", kind="extrude", points=(1, 2, 6, 9, 5), value=(-6.0,)),), 90.0),
        ((Part(id=1, name="f", kind="polygon", points=(5, 9, 6, 2, 1)), Part(
            id=2, name="e", kind="extrude", parts=(1,), value=(-6.0,))), 90.0),
        ((Part(id=1, name="l", kind="lathe", points=(13, 14, 13, 15, 14), value=(1000.0,)),), 2 * np.pi / 3),
        ((Part(id=1, name="l", kind="lathe", points=(13, 14, 14, 15, 13), value=(1000.0,)),), 2 * np.pi / 3),
        ((BOX, Part(id=2, name="m", kind="mirror", parts=(1,), points=(2, 3, 6))), 144.0),
        ((BOX, Part(id=2, name="m", kind="mirror", parts=(1,), points=(1, 2))), 144.0),
    ],
)  # fmt: skip
def test_what_is_built_is_closed_faces_outwards_and_has_its_volume(parts, volume):
    made = _made(*parts)
    assert made.volume == pytest.approx(volume, rel=1e-4)
    assert made.is_winding_consistent
    if len(parts) == 1:
        assert made.is_watertight


def test_a_bridge_closes_the_gap_between_two_outlines():
    front = Part(id=1, name="front", kind="polygon", points=(1, 5, 9, 6, 2))
    back = Part(id=2, name="back", kind="polygon", points=(3, 7, 10, 8, 4))
    made = _made(front, back, Part(id=3, name="between", kind="bridge", parts=(1, 2)))
    made.fix_normals()
    assert made.is_watertight
    assert abs(made.volume) == pytest.approx(90.0, rel=1e-6)


def test_points_that_move_take_the_model_with_them():
    before = built(MODEL.replace(parts=(BOX,)))
    moved = MODEL.points[0].replace(place=(-1.0, 0.0, 0.0))
    after = built(MODEL.replace(parts=(BOX,), points=(moved, *MODEL.points[1:])))
    assert before.points[:, 0].min() == 0.0
    assert after.points[:, 0].min() == -1.0
    np.testing.assert_array_equal(before.corners, after.corners)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (Part(id=1, name="x", kind="polygon", points=(1, 2)), "three points"),
        (Part(id=1, name="x", kind="box", points=(1, 2)), "corner"),
        (Part(id=1, name="x", kind="extrude", points=(1, 2, 6)), "height"),
        (Part(id=1, name="x", kind="extrude", points=(1, 11, 2), value=(1.0,)), "one line"),
        (Part(id=1, name="x", kind="lathe", points=(1, 2, 3, 4), value=(1e6,)), "segments"),
        (Part(id=1, name="x", kind="mirror", points=(1, 2)), "parts"),
        (Part(id=1, name="x", kind="bridge"), "two parts"),
    ],
)
def test_a_part_that_cannot_be_made_says_what_it_needs(part, words):
    with pytest.raises(UserError, match=words):
        built(MODEL.replace(parts=(part,)))
    with pytest.raises(UserError, match="solve the model"):
        built(MODEL.replace(parts=(BOX,), points=(MODEL.points[0].replace(place=None), *MODEL.points[1:])))


def _colour_of(places):
    """A colour for every place of the world."""
    return 0.5 + 0.4 * np.sin(places @ np.array([[1.1, 0.3, 0.2], [0.2, 1.3, 0.4], [0.3, 0.2, 0.9]]))


def _reached(made, centre, ways):
    """Along ways (N, 3) the nearest triangle's distance, by each of them (Moeller and Trumbore, 1997)."""
    nearest = np.full(len(ways), np.inf)
    for a, b, c in made.triangles:
        p = np.cross(ways, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (p @ (b - a))
            u = p @ (centre - a) * inverse
            v = ways @ np.cross(centre - a, b - a) * inverse
            t = np.cross(centre - a, b - a) @ (c - a) * inverse
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        nearest[met] = np.minimum(nearest[met], t[met])
    return nearest


def test_photographs_come_back_on_the_faces_they_were_taken_of():
    """Pictures of a painted box and a wall beside it; the texture is the paint wherever a photograph sees it."""
    size, focal = (480, 320), 400.0
    photos = (photo(1, (-6, 4, -9), size=size, focal=focal), photo(2, (10, 4, -8), size=size, focal=focal))
    wall = Part(id=2, name="wall", kind="polygon", points=(13, 15, 14))
    mesh, made = built(MODEL.replace(parts=(BOX, wall))), _made(BOX, wall)
    y, x = np.mgrid[0:320, 0:480]
    flat = np.stack([(x - 239.5) / focal, (y - 159.5) / focal, np.ones(x.shape)], -1).reshape(-1, 3)
    centres = [-one.rotation.T @ np.array(one.translation) for one in photos]
    pictures = []
    for one, centre in zip(photos, centres, strict=True):
        way = flat @ one.rotation
        t = _reached(made, centre, way)
        there = np.isfinite(t)
        picture = np.zeros((len(way), 3), np.float32)
        picture[there] = _colour_of(centre + t[there, None] * way[there])
        pictures.append(picture.reshape(320, 480, 3))
    done = textured(mesh, photos, pictures, side=512)
    checked = 0
    for rows in np.split(np.arange(len(mesh.corners)), np.cumsum(mesh.counts)[:-1]):
        loop, uv = mesh.points[mesh.corners[rows]].astype(float), done.mesh.uvs[rows].astype(float)
        normal, middle = np.cross(loop[1] - loop[0], loop[2] - loop[0]), loop.mean(0)
        for one, centre in zip(photos, centres, strict=True):
            xy, _ = seen_by(one, middle[None])
            free = _reached(made, centre, (middle - centre)[None])[0] > 0.999
            if (centre - middle) @ normal > 0 and free and (xy > 0).all() and (xy < size).all():
                at = uv.mean(0) * 512
                got = cv2.remap(done.picture, np.float32([[at[0] - 0.5]]), np.float32([[511.5 - at[1]]]), 1)[0, 0]
                np.testing.assert_allclose(got, _colour_of(middle[None])[0], atol=0.03)
                checked += 1
    assert checked >= 3
    assert 0.3 < done.seen < 1.0
    assert (done.mesh.uvs >= 0).all()
    assert (done.mesh.uvs <= 1).all()
