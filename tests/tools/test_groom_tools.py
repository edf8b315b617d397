"""What each tool does to hair, seen with other eyes than the tools have."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from core.camera import project
from core.errors import UserError
from core.groom.length import lengths
from core.groom.rows import take_rows
from core.overlay import Circle, Label, Marker, Polyline
from core.record import freeze
from core.workspace import Respect, Workspace
from tests.core.groom.small_grooms import segment_lengths
from tests.tools.scenes import BENT, SIZE, document, empty, guides_of, line, pointers, session, sight, symmetric_fur
from tools.ground import Pointer
from tools.session import Session

WAY = line((150, 190), (250, 210))


def pixels(points, eye=None):
    camera = (eye or sight()).camera
    return project(camera, points, SIZE, SIZE).xy


def stroke(s, name, way, eye=None, **params):
    s.choose(name, **params)
    s.hand.stroke(eye or sight(), way)
    return guides_of(s)


def distance_to(way, points, eye=None):
    """Pixels from each strand's points (G, P) to the nearest sample of a finely drawn way."""
    path = np.concatenate([np.linspace((a.x, a.y), (b.x, b.y), 50) for a, b in zip(way, way[1:] or way, strict=False)])
    return cKDTree(path).query(pixels(points, eye))[0]


def test_a_click_plants_one_guide_under_the_pointer():
    s = session()
    before = guides_of(s)
    after = stroke(s, "plant", pointers([(231, 164)]))
    assert len(after) == len(before) + 1
    assert after.ids[-1] == before.next_id
    np.testing.assert_allclose(pixels(after.points[-1, 0]), (231, 164), atol=0.01)
    near = np.argsort(np.linalg.norm(before.points[:, 0] - after.points[-1, 0], axis=1))[:4]
    a, b = lengths(after.points)[-1], lengths(before.points)[near]
    assert b.min() * 0.9 < a < b.max() * 1.1, "it takes after its neighbours"


def test_a_drag_plants_a_row_that_leans_along_it():
    s = session(empty())
    after = stroke(s, "plant", line((150, 200), (250, 200)), spacing=0.1, length=0.3, lean=0.8)
    gaps = np.linalg.norm(np.diff(after.points[:, 0].astype(np.float64), axis=0), axis=1)
    np.testing.assert_allclose(gaps, 0.1, atol=0.02)
    half = math.asin(50.0 / (200.0 / math.tan(0.3)) * 5.08)  # the arc from the middle to 50 pixels beside it
    assert len(after) == pytest.approx(1 + 2 * half / 0.1, abs=1)
    np.testing.assert_allclose(lengths(after.points), 0.3, rtol=1e-4)
    normals = after.points[:, 0] / np.linalg.norm(after.points[:, 0], axis=1, keepdims=True)
    along = after.points[:, 1] - after.points[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    np.testing.assert_allclose(np.arccos((along * normals).sum(axis=1)), 0.8, atol=0.1)
    sideways = along - (along * normals).sum(axis=1, keepdims=True) * normals
    assert (sideways[:, 0] > 0.5).all(), "along the drag, which goes right"


def test_a_row_in_a_pose_leans_along_the_drag_in_the_picture():
    s = session(empty(), Workspace(frame=BENT))
    stroke(s, "plant", line((150, 120), (250, 120)), spacing=0.1, length=0.3, lean=0.8)
    shown = s.hand._grounds(sight(), s.tool)[0].shown
    assert len(shown) > 6
    along = (shown.points[:, 1] - shown.points[:, 0]).astype(np.float64)
    normals = shown.roots.frames[:, 2].astype(np.float64)
    along -= (along * normals).sum(axis=1, keepdims=True) * normals
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    way = np.gradient(shown.points[:, 0].astype(np.float64), axis=0)
    way -= (way * normals).sum(axis=1, keepdims=True) * normals
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    assert (along * way).sum(axis=1).min() > 0.97


def test_scatter_fills_the_ring_to_its_spacing_and_no_further():
    s = session(empty())
    for _ in range(4):
        after = stroke(s, "scatter", line((180, 190), (220, 210)), spacing=0.1, size=40.0)
    roots = after.points[:, 0].astype(np.float64)
    assert cKDTree(roots).query(roots, k=2)[0][:, 1].min() >= 0.1 - 1e-6
    assert distance_to(line((180, 190), (220, 210)), roots).max() < 41.0
    # random places that stop fitting cover 55 % with discs of half the spacing
    inside = roots[distance_to(line((180, 190), (220, 210)), roots) < 30.0]
    area = (np.pi * 30.0**2 + 60.0 * math.hypot(40, 20)) / (SIZE / (2 * math.tan(0.3)) / 5.0) ** 2
    assert len(inside) * math.pi * 0.05**2 / area == pytest.approx(0.52, abs=0.1)


def test_a_click_scatters_a_count_everywhere_or_by_a_map():
    s = session(empty(), Workspace(respect=Respect(symmetry=True)))
    after = stroke(s, "scatter", pointers([(200, 200)]), how="everywhere", count=300)
    assert len(after) == 300
    assert abs(np.mean(after.points[:, 0], axis=0)).max() < 0.15
    s = session(empty())
    after = stroke(s, "scatter", pointers([(200, 200)]), how="map", map="half", count=100)
    assert len(after) == 100
    assert after.points[:, 0, 1].min() > -0.15
    with pytest.raises(UserError, match="half"):
        stroke(s, "scatter", pointers([(200, 200)]), how="map", map="other")


def reached(s, name, before, **params):
    after = stroke(s, name, WAY, **params)
    return after, (before.points != after.points).any(axis=(1, 2)) | (before.hold != after.hold).any(axis=1)


@pytest.mark.parametrize("name", ["comb", "length", "smooth", "cut", "hairspray"])
def test_a_ring_reaches_what_is_under_it_on_the_near_side(name):
    s = session()
    before = guides_of(s)
    after, changed = reached(s, name, before, size=30.0)
    near = distance_to(WAY, before.points).min(axis=1)
    facing = (before.points[:, 0] * (np.array([0, 0, 6.0]) - before.points[:, 0])).sum(axis=1) > 0
    assert not changed[near > 31.0].any()
    assert not changed[~facing & (before.points[:, 0, 2] < -0.3)].any()
    assert changed[(near < 8.0) & facing].mean() > 0.9
    assert np.array_equal(before.points[:, 0], after.points[:, 0])
    s.undo()
    _, through = reached(s, name, before, size=30.0, through=True)
    assert through.sum() > 1.3 * changed.sum()


@pytest.mark.parametrize("name", ["length", "hairspray"])
def test_what_a_brush_does_depends_on_the_way_not_on_how_often_the_mouse_speaks(name):
    out = []
    for count in (6, 60):
        s = session()
        s.hand.pen = s.hand.pen.replace(smoothing=0.0)
        after = stroke(s, name, line((150, 200), (250, 200), count), size=50.0, strength=0.3, falloff="constant")
        out.append(lengths(after.points) if name == "length" else after.hold.max(axis=1))
    change = out[1] - (lengths(symmetric_fur().points) if name == "length" else 0.0)
    assert change.max() > 0.05
    np.testing.assert_allclose(out[0], out[1], atol=0.45 * change.max())
    assert np.corrcoef(out[0], out[1])[0, 1] > 0.9


def test_length_grows_shrinks_and_sets():
    s = session()
    start = lengths(guides_of(s).points)
    grown = lengths(stroke(s, "length", WAY).points)
    s.undo()
    shrunk = lengths(stroke(s, "length", line((150, 190), (250, 210), ctrl=True)).points)
    assert (grown >= start - 1e-6).all()
    assert grown.max() > 1.1 * start.max()
    assert (shrunk <= start + 1e-6).all()
    assert np.array_equal(grown > start + 1e-6, shrunk < start - 1e-6)
    s.undo()
    for _ in range(6):
        after = lengths(stroke(s, "length", WAY, how="set", length=0.15, strength=1.0).points)
    assert np.abs(after[np.abs(after - start) > 1e-6] - 0.15).min() < 1e-3
    assert after.min() > 0.14


def test_the_ring_cuts_where_it_touches_and_the_line_where_it_crosses():
    s = session()
    before = guides_of(s)
    after = stroke(s, "cut", line((100, 150), (300, 150)), size=6.0, stub=0.0)
    cut = (before.points != after.points).any(axis=(1, 2))
    assert cut.any()
    assert (lengths(after.points)[cut] < lengths(before.points)[cut]).all()
    tips = distance_to(line((100, 150), (300, 150)), after.points[cut][:, -1])
    assert tips.max() < 8.5
    s.undo()
    s.choose("cut", how="line")
    s.hand.press(sight(), Pointer(100, 150))
    s.hand.move(line((100, 150), (300, 150))[1:])
    assert any(isinstance(o, Polyline) for o in s.hand.hover(sight(), Pointer(300, 150)))
    assert guides_of(s) is before
    s.hand.release()
    after = guides_of(s)
    cut = (before.points != after.points).any(axis=(1, 2))
    assert cut.any()
    # a tip at the root is one that was cut off whole
    np.testing.assert_allclose(pixels(after.points[cut][:, -1])[:, 1], 150.0, atol=0.2)


@pytest.mark.parametrize("how", ["ring", "line"])
def test_scissors_over_the_roots_leave_a_stub_of_every_hair(how):
    s = session()
    before = guides_of(s)
    to_and_fro = line((100, 150), (300, 150)) + line((300, 150), (100, 150))
    after = stroke(s, "cut", to_and_fro, size=30.0, stub=0.6, how=how)
    part = lengths(after.points) / lengths(before.points)
    assert part.min() == pytest.approx(0.6, rel=1e-3), "however often the hand goes over them"
    assert (part <= 1.0 + 1e-6).all()
    s.undo()
    shaved = stroke(s, "cut", to_and_fro, size=30.0, stub=0.0, how=how)
    assert (lengths(shaved.points) / lengths(before.points)).min() < 0.4


def test_hairspray_holds_and_wash_frees():
    s = session()
    sprayed = stroke(s, "hairspray", WAY, strength=1.0, start=0.5)
    rows = sprayed.hold[:, -1] >= 1.0  # what carries a locked point is locked with it
    assert rows.any()
    assert not sprayed.hold[:, :4].any()
    combed = stroke(s, "comb", line((150, 210), (250, 190)))
    assert np.array_equal(combed.points[rows], sprayed.points[rows])
    assert not np.array_equal(combed.points, sprayed.points)
    washed = stroke(s, "hairspray", line((150, 190), (250, 210), ctrl=True))  # Ctrl turns it into the wash
    assert s.history.names[-1] == "Wash"
    assert washed.hold.sum() < 0.5 * sprayed.hold.sum()


def test_smooth_evens_neighbours_out():
    guides = symmetric_fur()
    rng = np.random.default_rng(1)
    bent = guides.points + np.cumsum(rng.normal(0.0, 0.03, guides.points.shape), axis=1).astype(np.float32)
    bent[:, 0] = guides.points[:, 0]
    s = session(guides.replace(points=freeze(bent)))
    before = guides_of(s)
    for _ in range(3):
        after = stroke(s, "smooth", WAY, size=100.0, strength=1.0)

    def bend(g):
        steps = np.diff(g.points, axis=1) / segment_lengths(g)[:, :, None]
        return 1.0 - (steps[:, 1:] * steps[:, :-1]).sum(axis=2).mean(axis=1)

    touched = (before.points != after.points).any(axis=(1, 2))
    assert touched.sum() > 20
    assert bend(after)[touched].mean() < 0.7 * bend(before)[touched].mean()
    np.testing.assert_allclose(segment_lengths(after), segment_lengths(before), atol=2e-6)


def test_select_replaces_adds_and_removes():
    s = session()
    left, right = line((130, 180), (160, 220)), line((240, 180), (270, 220))
    first = stroke(s, "select", left, size=30.0).selected
    near = distance_to(left, guides_of(s).points).min(axis=1)
    assert first.any()
    assert not first[near > 31.0].any()
    second = stroke(s, "select", right).selected
    assert second.any()
    assert not (first & second).any()
    both = stroke(s, "select", line((130, 180), (160, 220), shift=True)).selected
    assert np.array_equal(both, first | second)
    assert np.array_equal(stroke(s, "select", line((240, 180), (270, 220), ctrl=True)).selected, first)
    assert np.array_equal(stroke(s, "select", line((130, 180), (160, 220), eraser=True)).selected.any(), False)
    beside = line((58, 180), (58, 220))  # where hair hangs over the rim of the ball, which ends at 69
    assert stroke(s, "select", beside, size=6.0).selected.any()
    assert not stroke(s, "select", beside, roots_only=True).selected.any()
    s.set_workspace(respect=Respect(symmetry=True))
    sides = stroke(s, "select", left, roots_only=False, size=30.0).selected
    assert sides.sum() == 2 * first.sum()


def test_a_selection_is_all_that_tools_edit():
    s = session()
    chosen = stroke(s, "select", line((130, 180), (160, 220)), size=30.0)
    combed = stroke(s, "comb", line((120, 200), (280, 200)), size=80.0)
    moved = (chosen.points != combed.points).any(axis=(1, 2))
    assert moved.any()
    assert not moved[~chosen.selected].any()
    fewer = stroke(s, "delete", line((120, 200), (280, 200)), size=150.0, roots_only=False)
    assert set(chosen.ids[~chosen.selected]) <= set(fewer.ids)
    assert len(fewer) < len(chosen)


def test_the_lasso_takes_what_it_encloses():
    s = session()
    corners = [(150, 150), (250, 150), (250, 250), (150, 250)]
    after = stroke(s, "lasso", pointers(corners), roots_only=True)
    s.hand.pen = s.hand.pen.replace(smoothing=0.0)
    after = stroke(s, "lasso", pointers(corners), roots_only=True)
    at = pixels(after.points[:, 0])
    inside = (np.abs(at - 200.0) < 50.0).all(axis=1) & (after.points[:, 0, 2] > 0)
    assert np.array_equal(after.selected, inside)
    s.hand.press(sight(), Pointer(100, 100))
    s.hand.move(pointers([(120, 100), (120, 140)]))
    (outline,) = s.hand.hover(sight(), Pointer(120, 140))
    assert outline.closed
    assert len(outline.points) == 3
    s.hand.cancel()


def test_islands_are_pieces_of_skin():
    from tests.core.groom.small_grooms import ball, mesh_of

    one = ball().skin.mesh
    apart = np.concatenate([one.points * 0.4 - [0.5, 0, 0], one.points * 0.4 + [0.5, 0, 0]])
    triangles = one.corners.reshape(-1, 3)
    mesh = mesh_of(apart, np.concatenate([triangles, triangles + len(one.points)]))
    start = document(empty())
    pair = start.meshes[0].replace(mesh=mesh, rig=None)
    s = Session(start.replace(meshes=(pair,), grooms=(start.grooms[0].replace(maps=()),)))
    everywhere = stroke(s, "scatter", pointers([(200, 200)]), how="everywhere", count=60)
    left = stroke(s, "islands", pointers([(133, 200)]))
    assert np.array_equal(left.selected, everywhere.points[:, 0, 0] < 0)
    both = stroke(s, "islands", pointers([(267, 200)], shift=True))
    assert both.selected.all()
    assert not stroke(s, "islands", pointers([(10, 10)])).selected.any()
    s.close(discard=True)
    s.evaluator.close()


def test_frozen_hair_is_safe_until_it_is_thawed():
    s = session()
    frozen = stroke(s, "freeze", WAY, size=40.0)
    assert frozen.frozen.any()
    combed = stroke(s, "comb", WAY, size=150.0)
    moved = (frozen.points != combed.points).any(axis=(1, 2))
    assert moved.any()
    assert not moved[frozen.frozen].any()
    assert not stroke(s, "freeze", line((150, 190), (250, 210), ctrl=True), size=60.0).frozen.any()


def test_delete_takes_what_grows_under_the_ring():
    s = session()
    before = guides_of(s)
    after = stroke(s, "delete", WAY, size=25.0)
    gone = ~np.isin(before.ids, after.ids)
    near = distance_to(WAY, before.points[:, :1])[:, 0]
    assert gone.any()
    assert near[gone].max() < 26.0
    assert after.next_id == before.next_id


def on_a_strand(s, row=None):
    """A strand on the near side and a place on it that no other passes as closely."""
    ground = s.hand._grounds(sight(), s.tool)[0]
    if row is None:
        row = int(np.flatnonzero(ground.screen.seen & (ground.shown.points[:, 0, 2] > 0.7))[0])
    return row, pointers([ground.screen.pixels[row, -1]])


@pytest.mark.parametrize("frame", [1001.0, BENT])
def test_clone_picks_a_strand_and_stamps_it(frame):
    s = session(workspace=Workspace(frame=frame))
    s.choose("clone")
    before = guides_of(s)
    row, place = on_a_strand(s)
    s.hand.stroke(sight(), place)
    assert s.history.names == ("New",)
    assert list(s.tool.params.source) == [before.ids[row]]
    shown = [o for o in s.hand.hover(sight(), place[0]) if isinstance(o, Polyline)]
    np.testing.assert_allclose(shown[0].points, s.hand._grounds(sight(), s.tool)[0].screen.pixels[row])
    s.choose("clone", scale=0.5)
    s.hand.press(sight(), pointers([(150, 150)])[0])
    s.hand.move(pointers([(180, 160), (240, 180)]))
    s.hand.release()
    after = guides_of(s)
    assert s.history.names == ("New", "Clone")
    assert len(after) == len(before) + 1, "one stamp, where the hand let go"
    assert lengths(after.points)[-1] == pytest.approx(0.5 * lengths(before.points)[row], rel=0.05)
    shown = s.hand._grounds(sight(), s.tool)[0].shown
    np.testing.assert_allclose(pixels(shown.points[-1, 0]), (240, 180), atol=0.1)
    s.set_workspace(groom=1)
    _, place = on_a_strand(s, len(after) - 1)
    s.hand.press(sight(), place[0]._replace(ctrl=True))
    s.hand.release()
    assert s.tool.params.source == (after.ids[-1],)


def test_clone_reshapes_strands_under_the_ring():
    s = session()
    stroke(s, "length", WAY, how="set", length=0.1, size=20.0, strength=1.0)
    s.choose("clone", onto="strands", size=45.0)
    seen = s.hand._grounds(sight(), s.tool)[0].screen.seen
    row = int(np.argmin(np.where(seen, lengths(guides_of(s).points), np.inf)))
    _, place = on_a_strand(s, row)
    s.hand.stroke(sight(), place)
    before = guides_of(s)
    s.hand.pen = s.hand.pen.replace(smoothing=0.0)
    s.hand.stroke(sight(), pointers([(200, 130)]))
    after = guides_of(s)
    assert np.array_equal(before.ids, after.ids)
    changed = np.abs(lengths(after.points) - lengths(before.points)) > 1e-4
    assert changed.any()
    np.testing.assert_allclose(lengths(after.points)[changed], lengths(before.points)[row], rtol=0.02)
    assert distance_to(pointers([(200, 130)]), before.points[changed][:, 0]).max() < 75.0


def test_clone_of_a_strand_that_is_gone_picks_anew():
    s = session()
    s.choose("clone", source=[10_000], source_groom=1)
    _, place = on_a_strand(s)
    s.hand.stroke(sight(), place)
    assert s.tool.params.source[0] < 10_000
    s.choose("clone", source=[])
    with pytest.raises(UserError, match="no hair under the pointer"):
        s.hand.stroke(sight(), pointers([(3, 3)]))


def test_measure_says_what_a_ruler_says():
    s = Session(document().replace(unit="cm"))
    s.choose("measure")
    row, place = on_a_strand(s)
    guides = guides_of(s)
    line_, label = s.hand.hover(sight(), place[0])
    np.testing.assert_allclose(line_.points, pixels(guides.points[row]))
    assert isinstance(label, Label)
    assert label.words == f"{100 * lengths(guides.points)[row]:.4g} cm, 12 points, 90° off the skin"
    s.hand.press(sight(), Pointer(200, 200))
    s.hand.move(line((200, 200), (260, 200))[1:])
    shown = s.hand.hover(sight(), Pointer(260, 200))
    words = next(o.words for o in shown if isinstance(o, Label))
    assert sum(isinstance(o, Marker) for o in shown) == 2
    a, b = (s.hand._grounds(sight(), s.tool)[0].hit(Pointer(x, 200)).point for x in (200, shown[-1].x - 14.0))
    assert float(words.split()[0]) == pytest.approx(100 * np.linalg.norm(a - b), rel=1e-3)
    s.hand.release()
    assert s.history.names == ("New",)
    s.close(discard=True)
    s.evaluator.close()


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_ring_in_world_units_stays_the_same_on_the_skin(orthographic):
    s = session()
    s.choose("comb", size=60.0, world=True)
    metres = []
    for distance in (3.0, 6.0, 24.0):
        eye = sight(distance=distance, orthographic=orthographic)
        ring = s.hand.hover(eye, Pointer(200.0, 200.0))[0]
        assert isinstance(ring, Circle)
        rim = np.array([[ring.radius * (distance - 1.0) * 2 * math.tan(0.3) / SIZE]])  # at the skin, z = 1
        metres.append(ring.radius * 3.6 / SIZE if orthographic else float(rim[0, 0]))
    np.testing.assert_allclose(metres, 0.06 * 2 * math.sqrt(3), rtol=0.01)
    s.choose("comb", world=False)
    assert {s.hand.hover(sight(distance=d), Pointer(200.0, 200.0))[0].radius for d in (3.0, 9.0)} == {60.0}


def test_pressure_makes_a_brush_stronger_or_larger_as_it_is_set():
    moved = {}
    for pressure in (0.2, 1.0):
        for size in (False, True):
            s = session()
            after = stroke(s, "comb", line((150, 190), (250, 210), pressure=pressure), pressure_size=size,
                           pressure_strength=not size)
            moved[pressure, size] = np.linalg.norm(after.points - symmetric_fur().points, axis=2).max(axis=1)
    assert moved[0.2, False].sum() < 0.6 * moved[1.0, False].sum()
    assert (moved[0.2, True] > 0).sum() < 0.6 * (moved[1.0, True] > 0).sum()


def test_a_slanted_pen_lifts_what_it_combs():
    heights = []
    for tilt in (0.0, 0.5, 1.2):
        s = session()
        for _ in range(3):
            after = stroke(s, "comb", line((150, 190), (250, 210), tilt_x=tilt), tilt_lift=0.9, lift=0.05)
        combed = (after.points != symmetric_fur().points).any(axis=(1, 2))
        heights.append(np.linalg.norm(after.points[combed, -1], axis=1).mean())
    assert heights[0] + 0.01 < heights[1] < heights[2] - 0.01
    s = session()
    plain = stroke(s, "comb", line((150, 190), (250, 210), tilt_x=1.2))
    s = session()
    assert np.array_equal(plain.points, stroke(s, "comb", WAY).points), "unless it is asked for"


def test_the_falloff_of_the_comb_is_what_its_setting_says():
    sums = {}
    for shape in ("sharp", "smooth", "flat", "constant"):
        s = session()
        after = stroke(s, "comb", WAY, falloff=shape, lay=0.0)
        sums[shape] = float(np.abs(after.points - symmetric_fur().points).sum())
    assert sums["sharp"] < sums["smooth"] < sums["flat"] < sums["constant"]


def test_a_screen_follows_what_moves_goes_and_comes():
    s = session()
    s.choose("comb")
    ground = s.hand._grounds(sight(), s.tool)[0]
    from tools.screen import Screen

    screen = Screen(ground.view, ground.guides)
    combed = stroke(s, "comb", WAY)
    fewer = take_rows(combed, np.arange(0, len(combed), 3))
    more = stroke(s, "scatter", WAY, how="everywhere", count=20)
    for guides in (combed, fewer, more, take_rows(more, np.zeros(0, np.int64)), combed):
        screen.follow(guides)
        fresh = Screen(ground.view, guides)
        for name in ("pixels", "low", "high", "seen"):
            assert np.array_equal(getattr(screen, name), getattr(fresh, name)), name
