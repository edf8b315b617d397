"""The scene follows its document: equal to one made from nothing, the same arrays where nothing changed."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from core.camera import frame_points
from core.demo.creature import demo_creature
from core.document import Document, MeshObject, with_groom, with_mesh
from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.dress import dress
from core.groom.groom import Groom, Map
from core.groom.grow import grow
from core.groom.plant import plant_scatter
from core.groom.rows import take_rows
from core.groom.style import load_style
from core.mesh.normals import mesh_normals
from core.mesh.skin import skin_at_rest
from core.mesh.surface import rest_from_posed, strands_on_deformed
from core.posed import skin_at
from core.record import freeze
from core.value import constant, formula
from core.workspace import ViewOptions
from viewport.document_scene import scene_of
from viewport.live_guides import FROZEN, PLAIN, SELECTED, SPRAYED, TROUBLE
from viewport.live_scene import Change, LiveScene
from viewport.posed_frames import PosedFrames
from viewport.view import View3D

HAIRS, GUIDES = 1500, 120


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.fixture(scope="module")
def document(evaluator) -> Document:
    creature = demo_creature()
    groom = dress(creature.mesh, load_style("fur"), evaluator, GUIDES, HAIRS, seed=2)
    rising = freeze(np.linspace(0.0, 1.0, len(creature.mesh.points), dtype=np.float32))
    groom = groom.replace(id=4, name="fur", mesh_id=2, maps=(*groom.maps, Map("rising", values=rising)))
    item = MeshObject(id=2, name="animal", mesh=creature.mesh, rig=creature.rig)
    return Document(meshes=(item,), grooms=(groom,))


def rest(live: LiveScene, document: Document, frame: float = 1001.0, **view) -> Change:
    """What an idle program does: jobs, then slices, until nothing is owed."""
    for _ in range(10):
        live.update(document, frame, **view)
        while live.catch_up() is not None:
            pass
        jobs = live.wanted_jobs()
        if not jobs:
            return live.update(document, frame, **view)
        for job in jobs:
            live.adopt(job.run())
    raise AssertionError("there is always another job")


def edited(document: Document, function, groom_id: int = 4) -> Document:
    groom = next(g for g in document.grooms if g.id == groom_id)
    return with_groom(document, function(groom))


def with_guides(groom: Groom, **changes) -> Groom:
    return groom.replace(guides=groom.guides.replace(**{k: freeze(v) for k, v in changes.items()}))


def combed(groom: Groom, rows=(3, 4, 5), by: float = 0.002) -> Groom:
    points = groom.guides.points.copy()
    points[list(rows), 1:] += np.float32(by)
    return with_guides(groom, points=points)


def coated(groom: Groom, **changes) -> Groom:
    return groom.replace(coat=groom.coat.replace(**changes))


def as_grown(change: Change, document: Document, evaluator: Evaluator, frame: float = 1001.0) -> None:
    """The very picture `scene_of` makes of coats grown from nothing, hairs by their ids."""
    skins = {item.id: skin_at(item, frame, evaluator) for item in document.meshes}
    children = {
        g.id: grow(g, next(m for m in document.meshes if m.id == g.mesh_id).mesh, evaluator, skins[g.mesh_id], frame)
        for g in document.grooms
    }
    wanted = scene_of(document, skins, children)
    for surface, other in zip(change.scene.surfaces, wanted.surfaces, strict=True):
        np.testing.assert_array_equal(surface.points, other.points)
        np.testing.assert_array_equal(surface.normals, other.normals)
        assert surface.color == other.color
    for coat, other in zip(change.scene.coats, wanted.coats, strict=True):
        assert coat.look == other.look
        order = coat.order[np.argsort(coat.ids[coat.order])]
        back = np.argsort(other.ids)
        np.testing.assert_array_equal(coat.ids[order], other.ids[back])
        np.testing.assert_array_equal(coat.points[order], other.points[back])
        np.testing.assert_array_equal(coat.normals[order], other.normals[back])
        assert (coat.widths is None) == (other.widths is None)
        if coat.widths is not None and other.widths is not None:
            np.testing.assert_array_equal(coat.widths[order], other.widths[back])


def test_guides_are_there_at_once_and_the_coat_when_it_has_grown(document, evaluator):
    live = LiveScene(evaluator)
    first = live.update(document, 1001.0)
    assert first.scene.coats == ()
    assert first.scene.guides[0].points is document.grooms[0].guides.points
    jobs = live.wanted_jobs()
    assert sorted(job.kind for job in jobs) == ["grow", "settle"]
    assert live.wanted_jobs() == [], "each job is handed out once"
    done = []
    threads = [threading.Thread(target=lambda job=job: done.append(job.run())) for job in jobs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in done:
        live.adopt(result)
    change = rest(live, document)
    as_grown(change, document, evaluator)
    assert change.troubles == ()


@pytest.mark.parametrize("frame", [1001.0, 1014.0, 1020.5])
def test_after_any_edits_the_picture_is_that_of_a_fresh_coat(document, evaluator, frame):
    live = LiveScene(evaluator)
    rest(live, document, frame)
    now = document
    skin = skin_at_rest(document.meshes[0].mesh, evaluator)
    for function in (
        combed,
        lambda g: coated(g, density=constant(0.4), frizz=formula("0.2 * (id % 2)")),
        lambda g: coated(g, width_tip=formula("0.0001 * (1 + id % 3)"), color_root=(0.3, 0.2, 0.1)),
        lambda g: g.replace(guides=plant_scatter(g.guides, skin, 2, seed=7)),
        lambda g: g.replace(guides=take_rows(g.guides, np.arange(9, len(g.guides)))),
        lambda g: coated(g, count=1000, length_map="rising"),
    ):
        now = edited(now, function)
        live.update(now, frame, stroking=True, hairs=100)
    as_grown(rest(live, now, frame), now, evaluator, frame)
    as_grown(rest(live, document, frame), document, evaluator, frame)


def test_where_nothing_changed_arrays_stay_the_same_objects(document, evaluator):
    live = LiveScene(evaluator)
    before = rest(live, document).scene
    again = live.update(document.replace(fps=25.0), 1001.0)
    assert again.rows == ()
    picked = edited(document, lambda g: with_guides(g, selected=np.arange(GUIDES) < 5))
    after = live.update(picked, 1001.0)
    assert after.rows == ()
    for scene in (again.scene, after.scene):
        for name in ("points", "ids", "normals", "order"):
            assert getattr(scene.coats[0], name) is getattr(before.coats[0], name)
        for name in ("points", "normals", "triangles"):
            assert getattr(scene.surfaces[0], name) is getattr(before.surfaces[0], name)
        assert scene.guides[0].points is before.guides[0].points
        assert scene.guides[0].normals is before.guides[0].normals
    assert again.scene.guides[0].states is before.guides[0].states
    assert after.scene.guides[0].states is not before.guides[0].states


def test_combing_writes_the_shown_rows_it_names_and_no_other(document, evaluator):
    live = LiveScene(evaluator)
    scene = rest(live, document).scene
    points, before = scene.coats[0].points, scene.coats[0].points.copy()
    change = live.update(edited(document, combed), 1001.0, stroking=True, hairs=400)
    assert change.scene.coats[0].points is points
    ((written, rows),) = change.rows
    assert written is points
    assert 0 < len(rows) < 200
    assert set(rows) <= set(scene.coats[0].order[:400])
    differ = np.flatnonzero((points != before).any(axis=(1, 2)))
    assert set(differ) <= set(rows)
    assert live.wanted_jobs() == [], "a hand that combs wants nothing slow"
    before = points.copy()
    while (slice_ := live.catch_up(0.0)) is not None:
        differ = np.flatnonzero((points != before).any(axis=(1, 2)))
        assert all(written is points for written, _ in slice_.rows)
        assert set(differ) <= {row for _, rows in slice_.rows for row in rows}
        before = points.copy()


def test_states_of_guides(document, evaluator):
    hold = np.zeros(document.grooms[0].guides.hold.shape, np.float32)
    hold[2, 3] = 0.1
    hold[3] = 1.0
    rows = np.arange(GUIDES)
    points = document.grooms[0].guides.points.copy()
    points[5] = 2.0 * points[5, :1] - points[5]  # through the skin
    marked = edited(document, lambda g: with_guides(
        g, hold=hold, frozen=np.isin(rows, [3, 4]), selected=rows == 6, points=points))
    live = LiveScene(evaluator)
    assert live.update(marked, 1001.0).scene.guides[0].states[5] == PLAIN  # not looked at yet
    states = rest(live, marked).scene.guides[0].states
    np.testing.assert_array_equal(states[[1, 2, 3, 4, 5, 6]], [PLAIN, SPRAYED, FROZEN, FROZEN, TROUBLE, SELECTED])
    healed = edited(marked, lambda g: with_guides(g, points=document.grooms[0].guides.points))
    assert rest(live, healed).scene.guides[0].states[5] == PLAIN
    fewer = edited(marked, lambda g: g.replace(guides=take_rows(g.guides, np.arange(1, GUIDES))))
    rest(live, marked)
    assert rest(live, fewer).scene.guides[0].states[4] == TROUBLE  # it goes with the guide


def test_guides_stand_on_the_posed_skin_and_can_be_brought_back(document, evaluator):
    item, guides = document.meshes[0], document.grooms[0].guides
    skin = skin_at(item, 1014.0, evaluator)
    live = LiveScene(evaluator)
    for settled in (False, True):  # without hairs, and on theirs
        lines = (rest if settled else LiveScene.update)(live, document, 1014.0).scene.guides[0]
        np.testing.assert_array_equal(
            lines.points, strands_on_deformed(item.mesh, guides.roots, guides.points, skin.points))
        back = rest_from_posed(item.mesh, guides.roots, lines.points, skin.points)
        assert np.abs(back - guides.points).max() < 1e-6 * skin.diagonal
        np.testing.assert_allclose(np.linalg.norm(lines.normals, axis=1), 1.0, atol=1e-6)
    later = edited(document, combed)
    lines = live.update(later, 1014.0, stroking=True, hairs=50).scene.guides[0]
    np.testing.assert_array_equal(lines.points, strands_on_deformed(
        item.mesh, guides.roots, later.grooms[0].guides.points, skin.points))


def test_exactly_the_density_of_the_coat_is_shown(document, evaluator):
    live = LiveScene(evaluator)
    rest(live, document)
    for density, count in ((0.5, 750), (0.1, 150), (0.0, 0), (1.0, 1500)):
        scene = live.update(edited(document, lambda g, d=density: coated(g, density=constant(d))), 1001.0).scene
        shown = scene.coats[0].order if scene.coats else []
        assert len(shown) == count
        if count:
            np.testing.assert_array_equal(scene.coats[0].ids[shown], np.arange(count))


def test_while_another_coat_grows_the_old_one_stays_and_one_job_runs_at_a_time(document, evaluator):
    live = LiveScene(evaluator)
    scene = rest(live, document).scene
    more = edited(document, lambda g: coated(g, count=1800))
    assert live.update(more, 1001.0).scene.coats[0].points is scene.coats[0].points
    (job,) = live.wanted_jobs()
    most = edited(document, lambda g: coated(g, count=2000))
    live.update(most, 1001.0)
    assert live.wanted_jobs() == []
    live.adopt(job.run())
    assert len(live.update(most, 1001.0).scene.coats[0].points) == 1800
    (job,) = live.wanted_jobs()
    live.adopt(job.run())
    assert len(live.update(most, 1001.0).scene.coats[0].points) == 2000


def test_another_mesh_has_no_hair_until_its_own_has_grown(document, evaluator):
    live = LiveScene(evaluator)
    rest(live, document)
    item = document.meshes[0]
    wider = item.replace(mesh=item.mesh.replace(points=freeze(item.mesh.points * np.float32(1.1))), rig=None)
    other = with_mesh(document, wider)
    assert live.update(other, 1001.0).scene.coats == ()
    as_grown(rest(live, other), other, evaluator)


def test_what_cannot_be_done_is_not_asked_for_for_ever(document, evaluator):
    live = LiveScene(evaluator)
    rest(live, document)
    bare = Map("bare", values=freeze(np.zeros(len(document.meshes[0].mesh.points), np.float32)))
    nowhere = edited(document, lambda g: coated(g.replace(maps=(*g.maps, bare)), density_map="bare"))
    live.update(nowhere, 1001.0)
    (job,) = live.wanted_jobs()
    with pytest.raises(UserError, match="density is zero") as reason:
        job.run()
    live.abandon(job, reason.value)
    live.update(nowhere, 1001.0)
    assert live.wanted_jobs() == []
    live.update(edited(nowhere, lambda g: coated(g, density_map="rising")), 1001.0)
    (job,) = live.wanted_jobs()
    live.abandon(job)  # cancelled: it may be asked for again
    assert [again.kind for again in live.wanted_jobs()] == ["grow"]


def test_values_that_cannot_be_evaluated_are_told_by_the_name_of_the_groom(document, evaluator):
    live = LiveScene(evaluator)
    rest(live, document)
    item = document.meshes[0]
    flat = with_mesh(document, item.replace(mesh=item.mesh.replace(uvs=None)))
    rest(live, flat)
    change = live.update(edited(flat, lambda g: coated(g, clump=formula("u"))), 1001.0)
    assert len(change.troubles) == 1
    assert change.troubles[0].startswith("fur: ")
    assert change.scene.coats


def test_hidden_isolated_ghosted_and_the_options_of_the_view(document, evaluator):
    item = document.meshes[0]
    two = with_mesh(document, item.replace(id=3, name="statue", rig=None))
    live = LiveScene(evaluator)
    rest(live, two)

    def shown(document=two, **options):
        scene = live.update(document, 1001.0, ViewOptions(**options)).scene
        return len(scene.surfaces), len(scene.coats), len(scene.guides)

    assert shown() == (2, 1, 1)
    assert shown(with_mesh(two, item.replace(hidden=True))) == (1, 0, 0)
    bald = with_groom(two, two.grooms[0].replace(hidden=True))
    assert shown(bald) == (2, 0, 0)
    assert live.wanted_jobs() == []
    assert shown() == (2, 1, 1)  # at once: its hair was kept
    assert shown(isolated=(3,)) == (1, 0, 0)
    assert shown(isolated=(2,)) == (1, 1, 1)
    assert shown(hair=False) == (2, 0, 1)
    assert shown(guides=False) == (2, 1, 0)
    ghosts = live.update(two, 1001.0, ViewOptions(ghosted=(3,))).scene.surfaces
    assert [s.ghost for s in ghosts] == [False, True]
    assert [s.covered for s in ghosts] == [True, False]
    wired = live.update(two, 1001.0, ViewOptions(wire=True)).scene.surfaces[0].edges
    pairs = {tuple(sorted(pair)) for pair in wired.tolist()}
    mesh = item.mesh
    wanted = set()
    for start, count in zip(mesh.starts.tolist(), mesh.counts.tolist(), strict=True):
        face = mesh.corners[start : start + count].tolist()
        wanted |= {tuple(sorted((face[i], face[(i + 1) % count]))) for i in range(count)}
    assert len(wired) == len(pairs)
    assert pairs == wanted


def test_a_map_is_shown_by_its_values_at_the_vertices(document, evaluator):
    live = LiveScene(evaluator)
    rising = next(m for m in document.grooms[0].maps if m.name == "rising").values
    options = ViewOptions(map="rising")
    assert live.update(document, 1001.0, options).scene.surfaces[0].values is rising
    assert live.update(document, 1001.0, ViewOptions(map="no such")).scene.surfaces[0].values is None
    mesh = document.meshes[0].mesh
    image = freeze(np.tile(np.linspace(0.0, 1.0, 512, dtype=np.float32), (512, 1)))  # u
    pictured = edited(document, lambda g: g.replace(maps=(*g.maps, Map("u", image=image))))
    values = live.update(pictured, 1001.0, ViewOptions(map="u")).scene.surfaces[0].values
    assert live.update(pictured, 1002.0, ViewOptions(map="u")).scene.surfaces[0].values is values
    wanted = [mesh.uvs[mesh.corners == vertex, 0].mean() for vertex in range(0, len(mesh.points), 97)]
    np.testing.assert_allclose(values[::97], wanted, atol=2e-3)


def test_frames_once_played_are_kept_until_the_animal_is_edited(document, evaluator):
    live = LiveScene(evaluator)
    assert live.cached_frames(document) == []
    poses = {f: live.update(document, f, stroking=True).scene.surfaces[0].points for f in (1003.0, 1004.0, 1005.5)}
    assert live.cached_frames(document) == [1003, 1004]
    for frame, points in poses.items():
        assert live.update(document, frame, stroking=True).scene.surfaces[0].points is points
    combed_one = edited(document, combed)
    live.update(combed_one, 1003.0)
    assert live.cached_frames(combed_one) == [1003, 1004]  # combing moves no skin
    item = document.meshes[0]
    other = with_mesh(document, item.replace(rig=item.rig.replace()))
    assert live.cached_frames(other) == []
    live.update(other, 1004.0)
    assert live.cached_frames(other) == [1004]


def test_poses_are_kept_within_their_budget_the_longest_unused_dropped(document, evaluator):
    item = document.meshes[0]
    one = PosedFrames(evaluator, 1 << 30)
    size = (one.posed(item, 1010.0), one.bytes)[1]
    assert size == 2 * item.mesh.points.nbytes
    few = PosedFrames(evaluator, 3 * size)
    for frame in (1010, 1011, 1012, 1010, 1013):
        few.posed(item, frame)
        assert few.bytes <= 3 * size
    assert few.cached(document) == [1010, 1012, 1013]


def test_a_mesh_that_is_held_has_the_normals_of_its_shape_whatever_was_shown_before(document, evaluator):
    item = document.meshes[0]
    frames = PosedFrames(evaluator)
    half = item.mesh.points.copy()
    half[: len(half) // 2, 1] += np.float32(0.01)
    other = item.mesh.replace(points=freeze(half * np.float32(1.5)))
    for mesh, surface in ((item.mesh, half), (item.mesh, half * 2), (other, half), (item.mesh, half), (other, half)):
        shown = item.replace(mesh=mesh, surface=freeze(surface.copy()))
        posed = frames.posed(shown, 1010.0)
        assert np.array_equal(posed.normals, mesh_normals(mesh, surface))
        assert frames.posed(shown, 1011.0) is posed


def test_a_picture_of_rows_written_in_place_is_that_of_a_scene_made_anew(document, evaluator, ctx):
    size = (160, 120)
    framebuffer = ctx.framebuffer([ctx.texture(size, 4)])
    camera = frame_points(document.meshes[0].mesh.points, (-0.6, -0.2, -0.7))

    def picture(view: View3D) -> bytes:
        view.draw_interactive(800)
        for _ in view.refine():
            pass
        view.present(framebuffer, size)
        return framebuffer.read(components=3)

    def show(view: View3D, change: Change) -> None:
        view.begin(change.scene, camera, size)
        for points, rows in change.rows:
            view.rows_changed(points, rows)

    live, view = LiveScene(evaluator), View3D(ctx)
    show(view, rest(live, document))
    first = picture(view)
    later = edited(document, lambda g: combed(g, range(40), 0.03))
    show(view, live.update(later, 1001.0, stroking=True, hairs=800))
    moving = picture(view)
    while (change := live.catch_up()) is not None:
        show(view, change)
    show(view, live.update(later, 1001.0, hairs=800))
    now = picture(view)
    other = View3D(ctx)
    show(other, rest(LiveScene(evaluator), later))
    assert picture(other) == now
    assert len({first, moving, now}) == 3
    view.release()
    other.release()
