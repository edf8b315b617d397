"""From a groom to its hairs: counts, prefixes, maps, motion, what is remembered."""

import numpy as np
import pytest

from core.curve import Curve, Key
from core.demo.creature import demo_creature
from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.dress import dress
from core.groom.export import groom_strands
from core.groom.groom import Coat, Groom, Map
from core.groom.grow import grow, measure
from core.groom.rows import no_guides
from core.groom.style import load_style
from core.mesh.skin import skin_posed
from core.mesh.surface import place_roots, root_positions
from core.pose.skinning import posed_points
from core.random import rand
from core.value import Value, constant, formula


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.fixture(scope="module")
def creature():
    return demo_creature()


@pytest.fixture(scope="module")
def groom(creature, evaluator):
    return dress(creature.mesh, load_style("fur"), evaluator, 200, 3000, seed=2)


def with_coat(groom: Groom, **changes) -> Groom:
    return groom.replace(coat=groom.coat.replace(**changes))


def by_id(children) -> np.ndarray:
    return children.points[children.row_of]


def test_twice_the_hairs_keeps_the_first_half_where_it_was(creature, groom, evaluator):
    few = by_id(grow(groom, creature.mesh, evaluator))
    many = by_id(grow(with_coat(groom, count=6000), creature.mesh, evaluator))
    np.testing.assert_array_equal(few, many[:3000])


def test_density_changes_no_surviving_hair(creature, groom, evaluator):
    whole = grow(groom, creature.mesh, evaluator)
    for density in (0.1, 0.5, 1.0):
        baked = whole.baked(density)
        assert len(baked.ids) == round(3000 * density)
        np.testing.assert_array_equal(baked.ids, np.arange(len(baked.ids)))
        np.testing.assert_array_equal(np.swapaxes(baked.points, 1, 2), by_id(whole)[: len(baked.ids)])


def test_length_is_a_value_that_follows_the_frame_and_the_id(creature, groom, evaluator):
    plain = with_coat(groom, clump=constant(0.0), frizz=constant(0.0), length_variation=constant(0.0))

    def lengths(value, frame=1.0):
        hairs = by_id(grow(with_coat(plain, length=value), creature.mesh, evaluator, frame=frame))
        return np.linalg.norm(np.diff(hairs.astype(np.float64), axis=2), axis=1).sum(axis=1)

    one = lengths(constant(1.0))
    np.testing.assert_allclose(np.median(lengths(constant(0.5)) / one), 0.5, rtol=1e-3)
    np.testing.assert_allclose(np.median(lengths(formula("frame / 10"), 3.0) / one), 0.3, rtol=1e-3)
    odd = lengths(formula("0.2 if id % 2 else 1"))
    np.testing.assert_allclose(np.median(odd[1::2] / one[1::2]), 0.2, rtol=1e-3)
    np.testing.assert_allclose(np.median(odd[::2] / one[::2]), 1.0, rtol=1e-3)


def test_hairs_turn_with_the_skin_and_roots_stay_on_it(creature, groom, evaluator):
    rest = grow(groom, creature.mesh, evaluator)
    points = posed_points(creature.mesh.points, creature.rig, 1024)
    assert np.abs(points - creature.mesh.points).max() > 0.01
    skin = skin_posed(creature.mesh, points, evaluator)
    posed = grow(groom, creature.mesh, evaluator, skin=skin)
    np.testing.assert_array_equal(rest.ids, posed.ids)
    roots = place_roots(
        creature.mesh, skin.triangles, posed.triangle,
        np.concatenate([posed.bary, 1 - posed.bary.sum(axis=1, keepdims=True)], axis=1),
    )
    on_skin = root_positions(creature.mesh, roots, points)
    np.testing.assert_allclose(posed.points[:, :, 0], on_skin, atol=2e-6)
    motion = np.linalg.norm(posed.points[:, :, -1] - rest.points[:, :, -1], axis=1)
    ahead = rest.points[:, 2, 0]
    assert np.median(motion[ahead > np.quantile(ahead, 0.9)]) > 0.02  # the head turns
    low = rest.points[:, 1, 0] < np.quantile(rest.points[:, 1, 0], 0.1)
    assert np.median(motion[low]) < 1e-3  # the feet stand still


def test_combing_does_not_scatter_or_bind_again(creature, groom, evaluator):
    class Clock:
        def __init__(self):
            self.stages = []

        def __call__(self, name):
            from contextlib import nullcontext

            self.stages.append((name, len(evaluator)))
            return nullcontext()

    grow(groom, creature.mesh, evaluator)
    remembered = len(evaluator)
    moved = groom.replace(guides=groom.guides.replace(points=groom.guides.points * np.float32(1.0)))
    grow(moved, creature.mesh, evaluator, stage=Clock())
    assert len(evaluator) == remembered


def test_rigid_motion_of_everything_moves_every_hair_rigidly(creature, groom, evaluator):
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    points = (creature.mesh.points.astype(np.float64) @ turn.T + [0.5, 0.25, -0.125]).astype(np.float32)
    calm = with_coat(groom, frizz=constant(0.0))
    rest = grow(calm, creature.mesh, evaluator).points.astype(np.float64)
    posed = grow(calm, creature.mesh, evaluator, skin=skin_posed(creature.mesh, points, evaluator)).points
    expected = np.einsum("rc,ncp->nrp", turn, rest) + np.array([0.5, 0.25, -0.125])[None, :, None]
    off = np.abs(posed - expected).max(axis=(1, 2))
    # settling looks at a grid that does not turn with the animal, so a few hairs in creases may differ
    assert np.median(off) < 1e-5
    assert (off < 1e-4).mean() > 0.9


def test_a_groom_without_guides_is_refused_in_words(creature, evaluator):
    bare = Groom(id=1, name="bare", mesh_id=1, guides=no_guides(16), coat=Coat(count=10))
    with pytest.raises(UserError, match="plant some"):
        grow(bare, creature.mesh, evaluator)


def test_no_hairs_at_all_is_a_groom_too(creature, groom, evaluator):
    none = grow(with_coat(groom, count=0), creature.mesh, evaluator)
    assert len(none) == 0
    assert measure(groom, creature.mesh, none, evaluator).inside_segments == 0


def test_an_animated_clump_moves_hairs_with_the_frame(creature, groom, evaluator):
    ramp = Value(base=Curve(keys=(Key(frame=1001, value=0.0), Key(frame=1011, value=1.0))))

    def at(frame, clump):
        return grow(with_coat(groom, clump=clump), creature.mesh, evaluator, frame=frame).points

    np.testing.assert_array_equal(at(1001, ramp), at(1001, constant(0.0)))
    np.testing.assert_array_equal(at(1011, ramp), at(1011, constant(1.0)))
    np.testing.assert_array_equal(at(1020, formula("(frame - 1000) / 10")), at(1001, constant(1.0)))  # held at 1
    middle = at(1006, ramp)
    assert np.abs(middle - at(1001, ramp)).max() > 1e-3
    assert np.abs(middle - at(1011, ramp)).max() > 1e-3


def test_a_map_times_clump_gathers_hair_where_it_is_painted(creature, groom, evaluator):
    left = (creature.mesh.points[:, 0] > 0).astype(np.float32)
    painted = groom.replace(maps=(*groom.maps, Map(name="wet", values=left)))
    calm = by_id(grow(with_coat(painted, clump=constant(0.0)), creature.mesh, evaluator))
    full = by_id(grow(with_coat(painted, clump=constant(0.8)), creature.mesh, evaluator))
    half = by_id(grow(with_coat(painted, clump=constant(0.8, "wet")), creature.mesh, evaluator))
    width = np.abs(creature.mesh.points[:, 0]).max()
    inside, outside = calm[:, 0, 0] > 0.3 * width, calm[:, 0, 0] < -0.3 * width
    assert min(inside.sum(), outside.sum()) > 100
    np.testing.assert_allclose(half[inside], full[inside], atol=1e-6)
    np.testing.assert_array_equal(half[outside], calm[outside])
    assert np.abs(full[outside] - calm[outside]).max() > 1e-3


def test_an_expression_of_the_id_gives_every_hair_its_own(creature, groom, evaluator):
    changes = {
        "clump": formula("0.2 + 0.3 * rand(id, 7)"), "frizz": formula("0.1 * rand(id, 8)"),
        "width_root": formula("0.001 * (1 + u)"), "width_tip": formula("0.0001 + 0.0001 * rand(id, 9)"),
        "length_variation": formula("0.5 if id % 2 else 0"),
    }
    children = grow(with_coat(groom, **changes), creature.mesh, evaluator)
    ids, traits = children.ids, children.traits
    np.testing.assert_array_equal(traits.shape.clump, (0.2 + 0.3 * rand(ids, 7)).astype(np.float32))
    np.testing.assert_array_equal(traits.shape.frizz, (0.1 * rand(ids, 8)).astype(np.float32))
    np.testing.assert_allclose(children.length[ids % 2 == 0], 1.0)
    assert 0.5 <= children.length[ids % 2 == 1].min() < 0.55
    strands = groom_strands(groom, creature.mesh, children)
    widths = strands.children.widths.reshape(-1, 16)
    np.testing.assert_allclose(widths[:, 0], 0.001 * (1 + strands.children.root_uvs[:, 0]), rtol=1e-5)
    np.testing.assert_allclose(widths[:, -1], 0.0001 + 0.0001 * rand(strands.children.ids, 9), rtol=1e-5)
    np.testing.assert_allclose(np.diff(widths, 2, axis=1), 0.0, atol=1e-9)  # evenly between
    np.testing.assert_allclose(strands.guides.widths.reshape(-1, 16)[:, 0], widths[:, 0].mean(), rtol=1e-5)
    plain = grow(groom, creature.mesh, evaluator)
    assert all(isinstance(number, float) for number in (*plain.traits[1:], *plain.traits.shape[:2]))
    assert plain.bytes_unbaked <= 48 * len(plain)
    assert children.bytes_unbaked > plain.bytes_unbaked


def test_a_density_expression_keeps_just_the_hairs_it_names_to_the_bit(creature, groom, evaluator):
    whole = groom_strands(groom, creature.mesh, grow(groom, creature.mesh, evaluator)).children
    points = whole.points.reshape(-1, 16, 3)
    before: set[int] = set()
    for percent in range(10, 101, 10):
        thin = with_coat(groom, density=formula(f"({percent} if u < 0.5 else 50) / 100"))
        strands = groom_strands(thin, creature.mesh, grow(thin, creature.mesh, evaluator)).children
        share = np.where(whole.root_uvs[:, 0] < 0.5, percent / 100, 0.5)
        sure = np.abs(np.arange(3000) - share * 3000) > 0.01  # where float32 cannot decide otherwise
        kept = np.isin(np.arange(3000), strands.ids)
        np.testing.assert_array_equal(kept[sure], (np.arange(3000) < share * 3000)[sure])
        np.testing.assert_array_equal(strands.points.reshape(-1, 16, 3), points[strands.ids])
        np.testing.assert_array_equal(strands.root_uvs, whole.root_uvs[strands.ids])
        assert before <= set(strands.ids.tolist())  # none pops away when it is turned up
        before = set(strands.ids.tolist())
    assert 1500 < len(before) < 3000


def test_faults_of_growing_name_the_field(creature, groom, evaluator):
    bare = creature.mesh.replace(uvs=None)
    with pytest.raises(UserError, match=r"^Frizz: u needs UVs and this mesh has none; [^\n]+$"):
        grow(with_coat(groom, frizz=formula("u")), bare, evaluator)
    image = groom.replace(maps=(Map(name="wet", image=np.ones((2, 2), np.float32)),))
    with pytest.raises(UserError, match=r"^Clump: an image map needs UVs"):
        grow(with_coat(image, clump=constant(1.0, "wet")), bare, evaluator)
