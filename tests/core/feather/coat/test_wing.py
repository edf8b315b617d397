"""Wings: anchors carried by the skin, the fan between two directions, the order of quills, what a hand adds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.curve import Curve, Key
from core.demo.bird import Bird, demo_bird
from core.demo.bird_document import bird_document
from core.document import Document, find_mesh, keys_of
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.layering import crossings
from core.feather.coat.plumage import Plumage
from core.feather.coat.posing import LENGTH, ROLL
from core.feather.coat.wing import WING_IDS, Anchor, Wing, WingOffset, WingRow, first_id
from core.feather.coat.wing_dress import dress_wings
from core.feather.coat.wing_pose import WingFeathers, anchor_move, lay_wings
from core.feather.coat.winged import Laid
from core.mesh.skin import skin_at_rest, skin_posed
from core.pose.skinning import posed_points
from core.record import freeze
from core.value import Value, constant, formula

FOLDED, HALF, OPEN = 1001.0, 1014.0, 1024.0


@pytest.fixture(scope="module")
def bird() -> Bird:
    return demo_bird()


@pytest.fixture(scope="module")
def wings(bird: Bird) -> tuple[Wing, ...]:
    return dress_wings(bird.mesh, bird.rig)


def _at(bird: Bird, wings: tuple[Wing, ...], frame: float | None) -> WingFeathers:
    rest = bird.mesh.points
    return lay_wings(wings, rest, rest if frame is None else posed_points(rest, bird.rig, frame), frame or 0.0)


def _row(wing: Wing, part: str) -> WingRow:
    return next(row for row in wing.rows if row.part == part)


def _of(wing: Wing, row: WingRow, laid: WingFeathers) -> np.ndarray:
    first = first_id(wing, row)
    return np.flatnonzero((laid.ids >= first) & (laid.ids < first + row.count))


def _replaced(wings: tuple[Wing, ...], part: str, **changes: object) -> tuple[Wing, ...]:
    changed = tuple(row.replace(**changes) if row.part == part else row for row in wings[0].rows)
    return (wings[0].replace(rows=changed), *wings[1:])


def test_an_anchor_finds_the_motion_of_its_patch() -> None:
    rng = np.random.default_rng(4)
    rest = rng.normal(size=(20, 3)).astype(np.float32)
    turn, shift = Rotation.from_rotvec([0.4, -2.1, 0.9]).as_matrix(), np.array([0.3, -1.0, 2.0])
    posed = (rest @ turn.T + shift).astype(np.float32)
    found = anchor_move(Anchor(joint="hand", vertices=freeze(np.arange(3, 15, dtype=np.int32))), rest, posed)
    np.testing.assert_allclose(found[0], turn, atol=2e-6)
    np.testing.assert_allclose(found[1], shift, atol=4e-6)
    mirrored = (rest * [-1.0, 1.0, 1.0]).astype(np.float32)  # no motion reaches this; what is found is still a rotation
    whole = Anchor(joint="hand", vertices=freeze(np.arange(9, dtype=np.int32)))
    assert np.linalg.det(anchor_move(whole, rest, mirrored)[0]) > 0.0


def test_a_small_bird_has_its_rows(wings: tuple[Wing, ...]) -> None:
    assert [wing.kind for wing in wings] == ["wing", "wing", "tail"]
    counts = {part: _row(wings[0], part).count for part in ("primaries", "secondaries", "tertials", "alula")}
    assert counts == {"primaries": 9, "secondaries": 9, "tertials": 3, "alula": 3}
    assert _row(wings[2], "tail").count == 12
    assert {"greater coverts", "median coverts", "lesser coverts"} <= {row.part for row in wings[0].rows}
    assert [anchor.joint for anchor in wings[0].anchors] == ["chest", "humerus_left", "forearm_left", "hand_left"]


def test_the_fan_opens_and_folds_with_the_joints(bird: Bird, wings: tuple[Wing, ...]) -> None:
    angles, tips = {}, {}
    for frame in (FOLDED, HALF, OPEN):
        laid = _at(bird, wings, frame)
        quills = np.concatenate([_of(wings[0], _row(wings[0], part), laid) for part in ("tertials", "primaries")])
        along = laid.frames[quills, 1].astype(float)
        angles[frame] = np.degrees(np.arccos(np.clip(along[0] @ along[-1], -1.0, 1.0)))
        outermost = quills[-1]
        tips[frame] = (laid.roots[outermost] + laid.frames[outermost, 1] * laid.poses[outermost, LENGTH])[0]
    assert angles[OPEN] > 60.0
    assert angles[FOLDED] < 25.0 < angles[HALF] < angles[OPEN]
    assert tips[FOLDED] < 0.03 < 0.10 < tips[OPEN]  # metres beside the middle of the body


def test_neighbours_keep_their_order_and_share_the_angle(bird: Bird, wings: tuple[Wing, ...]) -> None:
    still = _replaced(wings, "primaries")
    for frame in (None, HALF, OPEN):
        laid = _at(bird, still, frame)
        along = laid.frames[_of(wings[0], _row(wings[0], "primaries"), laid), 1].astype(float)
        up = laid.frames[_of(wings[0], _row(wings[0], "primaries"), laid), 2].astype(float)
        turns = np.degrees(np.einsum("nc,nc->n", np.cross(along[:-1], along[1:]), up[1:]))
        assert np.all(np.sign(turns) == np.sign(turns[0]))
        assert np.ptp(np.abs(turns)) < 0.8 * np.abs(turns).mean() + 2.0  # no gap in the fan


@pytest.mark.parametrize("frame", [None, OPEN])
def test_an_inner_feather_lies_over_the_next_outer_one(
    bird: Bird, wings: tuple[Wing, ...], frame: float | None
) -> None:
    laid = _at(bird, wings, frame)
    rows = _of(wings[0], _row(wings[0], "primaries"), laid)
    roots, up = laid.roots[rows].astype(float), laid.frames[rows, 2].astype(float)
    assert np.all(np.einsum("nc,nc->n", roots[:-1] - roots[1:], up[:-1]) > 0.0)
    leading_up = laid.poses[rows, ROLL] * np.where(laid.flipped[rows], 1.0, -1.0)
    assert np.all(leading_up > 0.0)
    assert laid.flipped[rows].all()
    assert not laid.flipped[_of(wings[1], _row(wings[1], "primaries"), laid)].any()


def test_coverts_follow_their_quills_as_far_as_they_are_told(bird: Bird, wings: tuple[Wing, ...]) -> None:
    angles = []
    for follow in (0.0, 0.5, 1.0):
        changed = _replaced(wings, "primary coverts", follow=follow)
        laid = _at(bird, changed, FOLDED)
        stiff = np.stack([m[0] for m in (anchor_move(changed[0].anchors[3], bird.mesh.points, posed_points(
            bird.mesh.points, bird.rig, FOLDED)),)])[0]
        rest = _at(bird, changed, None)
        rows = _of(changed[0], _row(changed[0], "primary coverts"), laid)
        along, with_bone = laid.frames[rows, 1].astype(float), rest.frames[rows, 1].astype(float) @ stiff.T
        up = laid.frames[rows, 2].astype(float)  # in the plane of the folded wing
        with_bone -= up * np.einsum("nc,nc->n", with_bone, up)[:, None]
        with_bone /= np.linalg.norm(with_bone, axis=1, keepdims=True)
        angles.append(np.degrees(np.arccos(np.clip(np.einsum("nc,nc->n", along, with_bone), -1.0, 1.0))).max())
    assert angles[0] < 0.2  # goes with the bone as if it were grown to it
    assert angles[0] < angles[1] < angles[2]
    assert angles[2] > 10.0


def test_ids_outlive_changes_and_other_rows_stay_to_the_bit(bird: Bird, wings: tuple[Wing, ...]) -> None:
    before = _at(bird, wings, OPEN)
    after = _at(bird, _replaced(wings, "alula", count=2), OPEN)
    assert before.ids.min() >= WING_IDS
    assert np.all(np.diff(before.ids.astype(np.int64)) > 0)
    kept = np.isin(before.ids, after.ids)
    assert kept.sum() == len(before.ids) - 1
    others = kept & (before.parts != "alula")
    same = np.isin(after.ids, before.ids[others])
    np.testing.assert_array_equal(before.roots[others], after.roots[same])
    np.testing.assert_array_equal(before.frames[others], after.frames[same])
    np.testing.assert_array_equal(before.poses[others], after.poses[same])


def test_a_hand_moves_one_feather_at_its_keys(bird: Bird, wings: tuple[Wing, ...]) -> None:
    spread = Value(base=Curve(keys=(Key(frame=1010.0, value=0.0), Key(frame=1020.0, value=0.3))))
    hand = _replaced(wings, "primaries", offsets=(WingOffset(number=9, spread=spread, bend=constant(0.2)),))
    plain = wings
    for frame, turned in ((1005.0, 0.0), (1030.0, 0.3)):
        a, b = _at(bird, plain, frame), _at(bird, hand, frame)
        row = _of(wings[0], _row(wings[0], "primaries"), a)[8]
        others = np.delete(np.arange(len(a.ids)), row)
        np.testing.assert_array_equal(a.frames[others], b.frames[others])
        np.testing.assert_array_equal(a.poses[others], b.poses[others])
        cosine = float(a.frames[row, 1].astype(float) @ b.frames[row, 1].astype(float))
        assert np.arccos(min(cosine, 1.0)) == pytest.approx(turned, abs=2e-3)
        outward = b.frames[row, 1].astype(float) - a.frames[row, 1]
        assert turned == 0.0 or outward @ a.frames[row, 0] * (1.0 if a.flipped[row] else -1.0) > 0.0


def test_expressions_read_how_far_the_wing_is_open(bird: Bird, wings: tuple[Wing, ...]) -> None:
    changed = _replaced(wings, "alula", length=formula("clamp(open, 0.1, 2)"))
    lengths = {}
    for frame in (None, FOLDED):
        laid = _at(bird, changed, frame)
        rows = _of(wings[0], _row(wings[0], "alula"), laid)
        lengths[frame] = float(laid.poses[rows, LENGTH].mean())
    plain = _at(bird, wings, None)
    rows = _of(wings[0], _row(wings[0], "alula"), plain)
    assert lengths[None] == pytest.approx(float(plain.poses[rows, LENGTH].mean()))
    assert lengths[FOLDED] < 0.4 * lengths[None]


def test_a_rig_without_wings_says_how_to_name_joints(bird: Bird) -> None:
    names = tuple(f"joint {k}" for k in range(len(bird.rig.skeleton.names)))
    plain = bird.rig.replace(skeleton=bird.rig.skeleton.replace(names=names))
    with pytest.raises(UserError, match="humerus, forearm and hand"):
        dress_wings(bird.mesh, plain)


@pytest.fixture(scope="module")
def dressed() -> tuple[Document, Evaluator]:
    evaluator = Evaluator()
    return bird_document(evaluator, 1200), evaluator


def _laid(document: Document, evaluator: Evaluator, frame: float, plumage: Plumage | None = None) -> Laid:
    coat = document.feathers[0]
    item = find_mesh(document, coat.mesh_id)
    assert item.rig is not None
    skin = skin_posed(item.mesh, posed_points(item.mesh.points, item.rig, frame), evaluator)
    return (plumage or Plumage(evaluator)).at_frame(coat, keys_of(document, coat), item.mesh, skin, frame)


def test_feathers_of_the_skin_make_way_for_those_of_the_wing(dressed: tuple[Document, Evaluator]) -> None:
    document, evaluator = dressed
    coat, mesh = document.feathers[0], document.meshes[0].mesh
    alone = coat.replace(placements=(coat.placements[0].replace(count=0),))
    for frame, share in ((None, 0.02), (FOLDED, 0.6), (OPEN, 0.6)):  # a frame lifts by little, so that nothing jumps
        found = []
        for worn in (coat, coat.replace(layered=False), alone):
            changed = document.replace(feathers=(worn,))
            laid = _laid(changed, evaluator, frame) if frame is not None else Plumage(evaluator).at_rest(
                worn, keys_of(changed, worn), mesh)
            found.append(laid)
        counts = []
        for laid in found[:2]:
            left = crossings(laid.layered, laid.skin.bvh, evaluator.workers)
            wing = laid.ids >= WING_IDS
            counts.append(int((wing[left.first] != wing[left.second]).sum()))
            if laid is found[0]:
                assert wing[left.skin].all()
                assert counts[0] <= 0.02 * left.pairs
        assert counts[0] <= share * counts[1]
        np.testing.assert_array_equal(found[0].layered.vanes[wing], found[2].layered.vanes)  # they lie where they lie


def test_feathers_of_the_skin_do_not_jump_when_the_wing_opens(dressed: tuple[Document, Evaluator]) -> None:
    document, evaluator = dressed
    plumage, before = Plumage(evaluator), None
    for frame in (1014.0, 1015.0, 1016.0):
        laid = _laid(document, evaluator, frame, plumage)
        body = laid.ids < WING_IDS
        tips = laid.layered.vanes[body][:, -1, 2].astype(float) - laid.feathers.roots[body]
        local = np.einsum("nij,nj->ni", laid.feathers.frames[body].astype(float), tips)
        if before is not None:
            moved = np.linalg.norm(local - before, axis=1) / laid.fields["length"][body]
            assert np.quantile(moved, 0.99) < 0.05
            assert (moved > 0.2).mean() < 0.002
        before = local


@pytest.mark.parametrize("frame", [FOLDED, HALF, OPEN])
def test_quills_and_their_coverts_slide_over_one_another(dressed: tuple[Document, Evaluator], frame: float) -> None:
    document, evaluator = dressed
    coat = document.feathers[0]
    parts = ("primaries", "secondaries", "tertials", "primary coverts", "greater coverts")
    wings = tuple(wing.replace(rows=tuple(row for row in wing.rows if row.part in parts)) for wing in coat.wings[:2])
    bare = coat.replace(wings=wings, placements=(coat.placements[0].replace(count=0),))
    laid = _laid(document.replace(feathers=(bare,)), evaluator, frame)
    left = crossings(laid.layered, laid.skin.bvh, evaluator.workers)
    assert len(laid.ids) == 2 * (9 + 9 + 3 + 9 + 13)
    assert left.pairs > 500  # so many lie close enough to cross
    assert len(left.first) <= 0.05 * left.pairs


def test_a_frame_reads_no_other(dressed: tuple[Document, Evaluator]) -> None:
    document, evaluator = dressed
    fresh = _laid(document, evaluator, HALF)
    plumage = Plumage(evaluator)
    for frame in (OPEN, FOLDED):
        _laid(document, evaluator, frame, plumage)
    again = _laid(document, evaluator, HALF, plumage)
    np.testing.assert_array_equal(fresh.layered.vanes, again.layered.vanes)
    np.testing.assert_array_equal(fresh.ids, again.ids)


def test_rows_of_the_wing_run_on_into_the_body(dressed: tuple[Document, Evaluator]) -> None:
    document, evaluator = dressed
    coat: FeatherCoat = document.feathers[0]
    item = find_mesh(document, coat.mesh_id)
    laid = Plumage(evaluator).at_rest(coat, keys_of(document, coat), item.mesh)
    assert laid.skin is skin_at_rest(item.mesh, evaluator)
    wing = laid.ids >= WING_IDS
    inner = np.flatnonzero(wing & ((laid.ids & 255) == 0) & ((laid.ids >> 16) & 255 == 0))
    names = {first_id(coat.wings[0], row): row for row in coat.wings[0].rows}
    body = np.flatnonzero(~wing)
    turns = []
    for row in inner:
        plan = names[int(laid.ids[row])]
        if "covert" not in plan.part or plan.anchors[0] != 0:
            continue
        away = np.linalg.norm(laid.feathers.roots[body] - laid.feathers.roots[row], axis=1)
        near = body[np.argsort(away)[:3]]
        cosine = laid.feathers.frames[near, 1].astype(float) @ laid.feathers.frames[row, 1].astype(float)
        turns.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).mean())
    assert len(turns) >= 3
    assert np.mean(turns) < 25.0
