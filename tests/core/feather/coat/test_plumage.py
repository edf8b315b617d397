"""A whole coat: nothing crosses, nothing depends on order, threads, history or another frame."""

import numpy as np
import pytest

from core.evaluator import Evaluator
from core.feather.coat.coat import AttributeValue, KeyAttributes
from core.feather.coat.dress import dress_feathers
from core.feather.coat.export import added_at_rest, instances
from core.feather.coat.layering import crossings
from core.feather.coat.plumage import Plumage
from core.feather.coat.posing import LENGTH, LIFT
from core.feather.coat.proxy import demoted, keyed, promoted
from core.feather.vane import SHAPE_COLUMNS
from core.mesh.skin import skin_posed
from core.record import freeze
from core.value import constant, formula
from core.workers import Workers
from tests.core.feather.coat.bodies import cells, crossing_by_solving, egg, meet

COUNT = 200


class Bird:
    """An egg dressed with feathers, and what evaluates it."""

    def __init__(self, threads: int = 2) -> None:
        self.evaluator = Evaluator(workers=Workers(threads))
        self.mesh = egg()
        self.coat, self.keys = dress_feathers(self.mesh, self.evaluator, COUNT, keys=20)
        self.plumage = Plumage(self.evaluator)

    def rest(self, coat=None, keys=None, **how):
        return self.plumage.at_rest(coat or self.coat, keys or self.keys, self.mesh, **how)

    def bent(self, angle):
        p = self.mesh.points.astype(np.float64)
        turn = angle * (p[:, 2] + 0.6)
        points = np.stack([p[:, 0], p[:, 1] * np.cos(turn) + 0.3 * np.sin(turn), p[:, 2] - p[:, 1] * np.sin(turn)], 1)
        return skin_posed(self.mesh, points.astype(np.float32), self.evaluator)

    def combed(self, key, turn=0.4):
        points = self.keys.guides.points.copy()
        strand = points[key].astype(np.float64) - points[key, 0]
        side = np.cross(self.keys.guides.roots.frames[key, 2], strand)
        points[key] = (points[key, 0] + np.cos(turn) * strand + np.sin(turn) * side).astype(np.float32)
        points[key, 0] = self.keys.guides.points[key, 0]
        return self.keys.replace(guides=self.keys.guides.replace(points=freeze(points)))


@pytest.fixture(scope="module")
def bird():
    made = Bird()
    yield made
    made.evaluator.close()


def test_no_feather_passes_through_another_or_the_skin(bird):
    laid = bird.rest()
    assert crossing_by_solving(laid.layered.vanes) == set()
    triangles = laid.skin.points[laid.skin.triangles.vertices].astype(np.float64)
    for vane in laid.layered.vanes[::13]:
        assert not meet(cells(vane), triangles)
    told = crossings(laid.layered, laid.skin.bvh, bird.evaluator.workers)
    assert len(told.first) == len(told.skin) == 0
    assert told.pairs > COUNT  # they do lie over one another
    naked = bird.rest(bird.coat.replace(layered=False))
    assert len(crossing_by_solving(naked.layered.vanes)) > 0.02 * told.pairs


def test_feathers_are_as_long_as_the_keys_and_lie_close(bird):
    poses = bird.rest().layered.poses
    wanted = np.linalg.norm(np.diff(bird.keys.guides.points[0], axis=0), axis=1).sum()
    # 200 feathers are long beside so small a body, which limits them
    assert 0.4 * wanted < np.median(poses[:, LENGTH]) < 1.1 * wanted
    assert (poses[:, LENGTH] > 0.15 * wanted).mean() > 0.9
    assert np.median(poses[:, LIFT]) < np.radians(20.0)


def test_threads_and_a_new_start_give_the_same_bits(bird):
    other = Bird(threads=1)
    np.testing.assert_array_equal(other.rest().layered.vanes, bird.rest().layered.vanes)
    np.testing.assert_array_equal(other.rest().ids, bird.rest().ids)
    other.evaluator.close()


def test_density_takes_feathers_away_and_leaves_the_others_as_they_were(bird):
    full = bird.rest()
    half = bird.rest(bird.coat.replace(density=constant(0.5)))
    fewer = bird.rest(bird.coat.replace(density=constant(0.25)))
    assert full.shown.all()
    assert 0.4 < half.shown.mean() < 0.6
    assert not (fewer.shown & ~half.shown).any()
    np.testing.assert_array_equal(half.layered.vanes, full.layered.vanes)


def test_a_quick_look_moves_only_what_a_key_moves_and_what_is_kept_does_not_remember_it(bird):
    before = bird.rest()
    combed = bird.combed(3)
    quick = bird.rest(keys=combed, quick=True)
    changed = (quick.layered.vanes != before.layered.vanes).any(axis=(1, 2, 3))
    assert 0 < changed.sum() < COUNT
    assert crossing_by_solving(quick.layered.vanes) == set()
    kept = bird.rest(keys=combed)
    fresh = Plumage(bird.evaluator).at_rest(bird.coat, combed, bird.mesh)
    np.testing.assert_array_equal(kept.layered.vanes, fresh.layered.vanes)


def test_no_frame_reads_another(bird):
    coat = bird.coat.replace(ruffle=formula("0.2 + 0.2 * sin(frame)"))
    frames = [1001, 1002, 1003, 1004]

    def played(order):
        plumage = Plumage(bird.evaluator)
        skins = {frame: bird.bent(0.1 * (frame - 1001)) for frame in order}
        return {
            frame: plumage.at_frame(coat, bird.keys, bird.mesh, skins[frame], float(frame)).layered.vanes
            for frame in order
        }

    forth, mixed = played(frames), played([1003, 1001, 1004, 1002])
    for frame in frames:
        np.testing.assert_array_equal(forth[frame], mixed[frame])
    assert (forth[1001] != forth[1004]).any()


def test_a_smooth_motion_makes_no_feather_jump(bird):
    tips = []
    for step in range(5):
        skin = bird.bent(0.008 * (step + 1))
        laid = bird.plumage.at_frame(bird.coat, bird.keys, bird.mesh, skin, 1001.0 + step)
        frames = bird.plumage.root_frames(bird.coat, bird.keys, bird.mesh, skin).astype(np.float64)
        away = laid.layered.vanes[:, -1, 2].astype(np.float64) - laid.feathers.roots
        tips.append(np.einsum("nij,nj->ni", frames, away) / laid.layered.poses[:, LENGTH:LENGTH + 1])
    jumps = np.linalg.norm(np.diff(tips, n=2, axis=0), axis=2)
    assert jumps.max() <= 0.02


def test_a_feather_is_taken_over_by_hand_and_given_back_and_the_others_do_not_notice(bird):
    rest = bird.rest()
    frames = bird.plumage.root_frames(bird.coat, bird.keys, bird.mesh)
    row = 40
    taken = promoted(
        bird.coat, int(rest.ids[row]), rest.layered.vanes[row], rest.feathers.roots[row], frames[row], 1001.0)

    def vanes(coat, frame):
        return bird.plumage.at_frame(coat, bird.keys, bird.mesh, rest.skin, frame).layered.vanes

    np.testing.assert_array_equal(vanes(taken, 1001.0), rest.layered.vanes)
    shaft = taken.proxies[0].rest.copy()
    shaft[:, 2] += 0.8 * shaft[:, 1]
    raised = keyed(taken, int(rest.ids[row]), 1011.0, shaft)
    np.testing.assert_array_equal(vanes(raised, 1001.0), rest.layered.vanes)
    moved = vanes(raised, 1011.0)
    middle = moved[row, :, 2].astype(np.float64)
    local = (middle - rest.feathers.roots[row]) @ frames[row].astype(np.float64).T
    np.testing.assert_allclose(local[-1], shaft[-1], atol=1e-6)
    halfway = vanes(raised, 1006.0)[row, -1, 2]
    np.testing.assert_allclose(halfway, 0.5 * (rest.layered.vanes[row, -1, 2] + moved[row, -1, 2]), atol=1e-5)
    assert {pair for pair in crossing_by_solving(moved) if row not in pair} == set()
    np.testing.assert_array_equal(vanes(demoted(raised, int(rest.ids[row])), 1011.0), rest.layered.vanes)


def test_attributes_come_from_keys_and_from_expressions(bird):
    ids = bird.keys.guides.ids
    given = KeyAttributes(
        ids=ids, names=("vaneWidthLeft",), values=np.linspace(0.05, 0.3, len(ids), dtype=np.float32)[:, None])
    coat = bird.coat.replace(
        layered=False, key_attributes=given,
        attributes=(AttributeValue(name="vaneWidthRight", value=formula("0.1 + 0.1 * age")),))
    laid = bird.rest(coat)
    own = laid.feathers.own
    left, right = -own[..., 0].min(axis=(1, 2)), own[..., 0].max(axis=(1, 2))
    assert "vaneWidthLeft" in SHAPE_COLUMNS
    assert np.corrcoef(left, laid.fields["vaneWidthLeft"])[0, 1] > 0.99
    assert np.corrcoef(right, laid.fields["age"])[0, 1] > 0.95
    same = bird.rest(coat.replace(key_attributes=given.replace(values=np.full((len(ids), 1), 0.17, np.float32))))
    np.testing.assert_allclose(same.fields["vaneWidthLeft"], 0.17, atol=1e-6)


def test_of_a_body_that_folds_hardly_any_feather_crosses_and_none_enters_the_skin(bird):
    rest = bird.rest()
    skin = bird.bent(3.5)
    laid = bird.plumage.at_frame(bird.coat, bird.keys, bird.mesh, skin, 1010.0)
    written = instances(laid, bird.evaluator.workers, added_at_rest(rest, bird.evaluator.workers))
    assert len(crossing_by_solving(written.vanes)) <= 0.01 * written.left.pairs
    triangles = skin.points[skin.triangles.vertices].astype(np.float64)
    assert not any(meet(cells(vane), triangles) for vane in written.vanes[::7])
    assert len(written.left.skin) == 0
