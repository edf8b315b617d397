"""The interactive view of the demo animal, 1600x1000, with the OpenGL there is (Mesa in software without a card)."""

from __future__ import annotations

import time

import numpy as np

from core.camera import Camera, frame_points
from core.demo.document import demo_document
from core.evaluator import Evaluator
from core.groom.grow import grow
from core.mesh.skin import skin_at_rest
from core.mesh.surface import root_normals
from core.overlay import Circle, Polyline
from core.workspace import ViewOptions
from tests.bench.bench import Row, median_ms
from viewport.context import temporary_context
from viewport.document_scene import look_of, skin_of
from viewport.scene import Coat, GuideLines, Scene, Surface
from viewport.view import View3D

TITLE = "Interactive view"
HAIRS, GUIDES = 100_000, 2_500
SIZE = (1600, 1000)


def run() -> list[Row]:
    """Rows of the table: moving pictures of 3,000 and 10,000 hairs, what is cached, refinement and its slices."""
    evaluator = Evaluator()
    document = demo_document(evaluator, HAIRS, GUIDES)
    mesh, groom = document.meshes[0].mesh, document.grooms[0]
    skin, children = skin_at_rest(mesh, evaluator), grow(groom, mesh, evaluator)
    look = look_of(groom.coat, children.traits)
    points = children.points
    coat = Coat(points, children.ids, children.roots()[1], look, order=children.row_of)
    surface = Surface(skin.points, skin.normals, skin.triangles.vertices, skin_of(look))
    normals = root_normals(mesh, groom.guides.roots)
    guides = GuideLines(groom.guides.points, np.zeros(GUIDES, np.uint8), normals=normals)
    scene = Scene((surface,), (coat,), (guides,))
    camera = frame_points(skin.points, aspect=1.6)
    dirty = np.arange(HAIRS // 20)
    rows = []
    with temporary_context() as ctx:
        color = ctx.texture(SIZE, 4)
        target = ctx.framebuffer([color])
        view = View3D(ctx)
        driver = str(ctx.info["GL_RENDERER"])
        overlays = (Circle(800.0, 500.0, 70.0), Polyline(np.array([[800.0, 500.0], [760.0, 530.0]]), "accent", 2.0))
        hud = [("Comb", "accent"), "guides 2,500", "hairs 3,000 of 100,000"]

        def present() -> None:
            view.present(target, SIZE, overlays, hud)
            ctx.finish()

        def combed(hairs: int) -> None:
            view.rows_changed(points, dirty)
            view.draw_interactive(hairs)
            present()

        for hairs, bound in ((3_000, 33.0), (10_000, None)):
            for shown in (False, True):
                view.begin(scene, camera, SIZE, ViewOptions(guides=shown))
                cost = median_ms(lambda hairs=hairs: combed(hairs))
                what = f"{hairs:,} hairs{f' and {GUIDES:,} guides' if shown else ''}, 5 % of the rows changed"
                rows.append(Row(f"A moving picture of {what} ({driver})", cost, "ms", None if shown else bound))
        rows.append(Row("The pointer alone: ring and words over the last picture", median_ms(present), "ms", 11.0))
        base = view.moving.base
        assert base is not None

        def copied() -> None:
            ctx.copy_framebuffer(view._target(0), base.framebuffer)
            ctx.finish()

        rows.append(Row("Copying the cached meshes, colour and depth", median_ms(copied), "ms"))
        turned = iter(range(100))

        def orbit() -> None:
            angle = 0.02 * (next(turned) + 1)
            turn = np.eye(4)
            turn[[0, 0, 2, 2], [0, 2, 0, 2]] = np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle)
            moved = camera.replace(world_from_camera=turn @ camera.world_from_camera)
            view.begin(scene, moved, SIZE, ViewOptions())
            view.draw_interactive(3_000)
            present()

        what = "The camera turns: meshes, 3,000 hairs and guides anew, the light where it must"
        rows.append(Row(what, median_ms(orbit), "ms", 33.0))
        rows += _refined(view, scene, camera)
        stroke = median_ms(lambda: combed(3_000))
        rows.append(Row("A stroke over the finished picture, 3,000 hairs and guides", stroke, "ms", 33.0))
        for thing in (view, target, color):
            thing.release()
    return rows


def _refined(view: View3D, scene: Scene, camera: Camera) -> list[Row]:
    full, finished, longest, slices = [], [], 0.0, 0
    for turn in range(3):
        moved = scene._replace(exposure=1.0 + 0.01 * turn)
        view.begin(moved, camera, SIZE, ViewOptions())
        view.draw_interactive(3_000)
        view.picture_changed = False
        start = before = time.perf_counter()
        shown = []
        for _ in view.refine():
            now = time.perf_counter()
            if turn:
                longest, slices = max(longest, now - before), slices + 1
            before = now
            if view.picture_changed:
                shown.append(now - start)
                view.picture_changed = False
        full.append(shown[0])
        finished.append(shown[-1])
    return [
        Row(f"All {HAIRS:,} hairs shown, from rest", min(full), "s", 2.0),
        Row("The finished picture, from rest", min(finished), "s", 5.0),
        Row("The longest slice of both", longest * 1e3, "ms", 100.0),
        Row("A slice on average", sum(finished[1:]) / max(slices, 1) * 1e3, "ms"),
    ]
