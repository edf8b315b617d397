"""The scene of a document while it is edited: arrays stay the same objects where nothing changed.

For a window with a :class:`viewport.view.View3D`::

    live = LiveScene(session.evaluator)

    # after any change of the document, the frame or the options, while a hand moves or the timeline plays
    show(live.update(document, frame, options, stroking=True, hairs=controller.drawn))

    # when the hand rests: once, then a slice from a timer of 0 ms until None; refine the picture only after that
    show(live.update(document, frame, options, hairs=controller.drawn))
    change = live.catch_up()                                 # None: nothing is owed
    if change is not None: show(change)

    # after every update: what takes long is done on other threads, and update is called again when one is done
    for job in live.wanted_jobs(): start(job.run)            # returns `done`: live.adopt(done), on the window's thread
                                                             # fails or is cancelled: live.abandon(job, error or None)

    def show(change):
        view.begin(change.scene, camera, size, options)
        for points, rows in change.rows: view.rows_changed(points, rows)

Until a coat has grown its guides stand alone; while another one grows, the old one stays where it still fits.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.document import Document, MeshObject, visible_grooms
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.plumages import Plumages
from core.groom.binding import CoatBinding
from core.groom.children import Traits
from core.groom.collision import Collision, collision
from core.groom.groom import Coat as CoatRecord
from core.groom.groom import Groom, Map
from core.groom.live_coat import LiveCoat, bind_coat
from core.groom.maps import at_vertices
from core.mesh.edges import edge_vertices
from core.mesh.skin import Posed, skin_at_rest
from core.workspace import ViewOptions
from viewport.document_scene import SKIN, look_of, painted_parts, skin_of, under_feathers, widths_of
from viewport.live_feathers import Asked, FeatherPicture, LiveFeathers
from viewport.live_guides import LiveGuides
from viewport.posed_frames import PosedFrames
from viewport.scene import Coat, GuideLines, Look, Scene, Surface

CHECKED_AT_ONCE = 400  # guides looked at for trouble in one update (1.5 ms)
SMALLEST, LARGEST = 250, 20_000  # hairs in one slice


class Rows(NamedTuple):
    """Rows (n,) int32, ascending, of the points of a coat that were written in place."""

    points: NDArray[np.float32]
    rows: NDArray[np.int32]


class Change(NamedTuple):
    """The scene as it is now.

    rows : what was written in place since the change before. Whatever is another object than before is new as a whole.
    troubles : sentences on what cannot be shown as the document says.
    """

    scene: Scene
    rows: tuple[Rows, ...] = ()
    troubles: tuple[str, ...] = ()


class Done(NamedTuple):
    """The result of a job, for :meth:`LiveScene.adopt`."""

    job: Job
    value: LiveCoat | CoatBinding | Collision | FeatherPicture


class Job(NamedTuple):
    """Something slow. `run` is called on any thread and touches nothing that is shown.

    name : for people. kind, id : grow or bind, of a groom; lay, of feathers; settle, of a mesh. about : what for.
    """

    name: str
    kind: str
    id: int
    about: object
    work: Callable[[], LiveCoat | CoatBinding | Collision | FeatherPicture]

    def run(self) -> Done:
        """Do it. UserError when it cannot be done: hand the job to :meth:`LiveScene.abandon` then."""
        return Done(self, self.work())


class _Shown:
    """What is kept for one groom."""

    def __init__(self) -> None:
        self.guides = LiveGuides()
        self.coat: LiveCoat | None = None
        self.look: tuple[CoatRecord, Traits, Look, NDArray[np.float32] | None] | None = None


class LiveScene:
    """Follows a document. Mutable; used from one thread, only the functions of its jobs run on others.

    Parameters
    ----------
    evaluator, plumages : of the session.
    frame_bytes : most memory for posed meshes, see :meth:`cached_frames`.
    """

    def __init__(
        self, evaluator: Evaluator, frame_bytes: int = 256 << 20, plumages: Plumages | None = None
    ) -> None:
        self._evaluator = evaluator
        self._frames = PosedFrames(evaluator, frame_bytes)
        self._feathers = LiveFeathers(evaluator, plumages)
        self._grooms: dict[int, _Shown] = {}
        self._skins: dict[tuple[int, bool], Collision] = {}  # by mesh and whether it is at rest, one pose each
        self._asked: dict[tuple[str, int], Job] = {}
        self._refused: dict[tuple[str, int], tuple[object, str]] = {}
        self._pace = {True: 1e5, False: 1e6}  # hairs a second, settled or only evaluated
        self._document, self._frame, self._options = Document(), 0.0, ViewOptions()
        self._stroking = False
        self._hairs: int | None = None
        self._groom: int | None = None
        self._change = Change(Scene())

    # -- following ---------------------------------------------------------------------------------------

    def update(
        self, document: Document, frame: float, options: ViewOptions | None = None, stroking: bool = False,
        hairs: int | None = None, groom: int | None = None,
    ) -> Change:
        """Follow the document, its frame and the options of the view.

        Parameters
        ----------
        stroking : a hand moves or the timeline plays: nothing slow is asked for, what can wait waits.
        hairs : at most so many hairs of every coat are drawn now, the first of its order; only they are evaluated,
            the rest by :meth:`catch_up`. None for all, which may take 30 ms for 100,000.
        groom : the active one; its map is shown first where several have one of the name.
        """
        self._document, self._frame, self._stroking, self._hairs = document, frame, stroking, hairs
        self._options = ViewOptions() if options is None else options
        self._groom = groom
        self._feathers.follow(document)
        alive = {item.id for item in document.grooms}
        self._grooms = {k: shown for k, shown in self._grooms.items() if k in alive}
        meshes = {item.id for item in document.meshes}
        self._skins = {k: skin for k, skin in self._skins.items() if k[0] in meshes}
        return self._follow()

    def catch_up(self, seconds: float = 0.012) -> Change | None:
        """Spend about so long on what is owed (in creases twice as long); None when nothing is, or only what jobs
        will bring."""
        start = time.perf_counter()
        for item, groom, posed in self._visible():
            shown, skin = self._grooms[groom.id], self._skin(item, posed)
            coat = shown.coat
            if coat is None or not self._options.hair or coat.mesh is not item.mesh or not coat.owing(skin):
                continue
            rows = coat.catch_up(int(np.clip(seconds * self._pace[skin is not None], SMALLEST, LARGEST)), skin)
            spent = max(time.perf_counter() - start, 1e-6)
            pace = self._pace[skin is not None]
            self._pace[skin is not None] = min(1.25 * pace, len(rows) / spent)  # down at once, up bit by bit
            self._change = self._change._replace(rows=(Rows(coat.children.points, rows),))
            return self._change
        for item, groom, _ in self._visible():
            guides, rest = self._grooms[groom.id].guides, self._rest_skin(item)
            if rest is not None and guides.unchecked:
                guides.check(4 * CHECKED_AT_ONCE, rest, self._evaluator.workers)
                self._change = self._change._replace(scene=self._scene(), rows=())
                return self._change
        return None

    def cached_frames(self, document: Document) -> list[int]:
        """Whole frames whose poses are in memory, ascending; edits of meshes and rigs empty them."""
        return self._frames.cached(document)

    # -- what takes long ---------------------------------------------------------------------------------

    def wanted_jobs(self) -> list[Job]:
        """What should be done on another thread for the document last followed. Each is handed out once, until it is
        given to :meth:`adopt` or :meth:`abandon`."""
        jobs = [job for job in self._jobs() if self._may_ask(job)]
        self._asked |= {(job.kind, job.id): job for job in jobs}
        return jobs

    def adopt(self, done: Done) -> None:
        """Take the result of a job; call :meth:`update` next."""
        job, value = done
        self._asked.pop((job.kind, job.id), None)
        self._refused.pop((job.kind, job.id), None)
        if isinstance(value, Collision):
            item = next((m for m in self._document.meshes if m.id == job.id), None)
            if item is not None:
                self._skins[job.id, value.points is item.mesh.points] = value
            return
        if isinstance(value, FeatherPicture):
            assert isinstance(job.about, Asked)
            self._feathers.adopt(job.about, value)
            return
        shown = self._grooms.get(job.id)
        if shown is None:
            return
        if isinstance(value, LiveCoat):
            shown.coat = value
        elif shown.coat is not None and isinstance(job.about, _About) and shown.coat is job.about.coat:
            shown.coat.take_binding(value, job.about.groom.guides)

    def abandon(self, job: Job, reason: UserError | None = None) -> None:
        """The job was cancelled, or failed for a reason: then it is asked for again only when its groom or mesh is
        another."""
        self._asked.pop((job.kind, job.id), None)
        if reason is not None:
            self._refused[job.kind, job.id] = (job.about, str(reason))

    def _may_ask(self, job: Job) -> bool:
        key = job.kind, job.id
        refused = self._refused.get(key)
        return key not in self._asked and (refused is None or not _same_about(refused[0], job.about))

    def _jobs(self) -> list[Job]:
        evaluator, frame, hairs = self._evaluator, self._frame, self._hairs
        jobs: list[Job] = []
        for item, groom, posed in self._visible():
            shown = self._grooms[groom.id]
            coat, skin = shown.coat, self._skin(item, posed)
            if self._options.hair and len(groom.guides):
                about = _About(groom, item, coat)
                if coat is None or coat.needs_growth(groom, item.mesh):
                    def grow(groom: Groom = groom, item: MeshObject = item, posed: Posed = posed) -> LiveCoat:
                        return LiveCoat(groom, item.mesh, evaluator, frame, posed, hairs)

                    jobs.append(Job(f"Growing the hair of {groom.name}", "grow", groom.id, about, grow))
                elif coat.needs_binding(self._stroking):
                    def bind(groom: Groom = groom, item: MeshObject = item) -> CoatBinding:
                        return bind_coat(groom, item.mesh, evaluator)

                    jobs.append(Job(f"Binding the hair of {groom.name}", "bind", groom.id, about, bind))
            if self._stroking or any(job.kind == "settle" and job.id == item.id for job in jobs):
                continue
            if skin is None and self._options.hair and coat is not None and coat.unsettled:
                wanted = posed.points
            elif self._rest_skin(item) is None and shown.guides.unchecked:
                wanted = item.mesh.points
            else:
                continue

            def settle(item: MeshObject = item, points: NDArray[np.float32] = wanted) -> Collision:
                return collision(item.mesh, points, evaluator)

            jobs.append(Job(f"Preparing the skin of {item.name}", "settle", item.id, wanted, settle))
        if not self._stroking and self._document.feathers:
            asked = self._feathers.wanted(self._document, self._posed, self._visible_meshes(), frame)
            jobs += [Job(f"Laying the feathers of {a.coat.name}", "lay", a.coat.id, a, lay) for a, lay in asked]
        return jobs

    # -- how ---------------------------------------------------------------------------------------------

    def _visible_meshes(self) -> list[MeshObject]:
        only = self._options.isolated
        return [m for m in self._document.meshes if not m.hidden and (not only or m.id in only)]

    def _posed(self, item: MeshObject) -> Posed:
        return self._frames.posed(item, self._frame)

    def _visible(self) -> list[tuple[MeshObject, Groom, Posed]]:
        meshes = {item.id: item for item in self._visible_meshes()}
        return [
            (meshes[groom.mesh_id], groom, self._frames.posed(meshes[groom.mesh_id], self._frame))
            for groom in visible_grooms(self._document) if groom.mesh_id in meshes
        ]

    def _skin(self, item: MeshObject, posed: Posed) -> Collision | None:
        """What hairs in this pose settle on, when it is there."""
        found = self._skins.get((item.id, posed.points is item.mesh.points))
        return found if found is not None and found.points is posed.points else None

    def _rest_skin(self, item: MeshObject) -> Collision | None:
        found = self._skins.get((item.id, True))
        return found if found is not None and found.points is item.mesh.points else None

    def _follow(self) -> Change:
        visible = self._visible()
        for _, groom, _ in visible:
            self._grooms.setdefault(groom.id, _Shown())
        rows: list[Rows] = []
        troubles: list[str] = []
        for item, groom, posed in visible:
            coat = self._coat(groom, item)
            if coat is None or not self._options.hair:
                continue
            written = coat.follow(groom, self._frame, posed, self._hairs)
            if len(written):
                rows.append(Rows(coat.children.points, written))
            if coat.trouble is not None:
                troubles.append(f"{groom.name}: {coat.trouble}")
        workers = self._evaluator.workers
        for item, groom, posed in visible:
            shown = self._grooms[groom.id]
            shown.guides.follow(groom.guides, item.mesh, posed, shown.coat, workers)
            rest = self._rest_skin(item)
            if rest is not None and not self._stroking:
                shown.guides.check(CHECKED_AT_ONCE, rest, workers)
        self._change = Change(self._scene(), tuple(rows), tuple(troubles))
        return self._change

    def _coat(self, groom: Groom, item: MeshObject) -> LiveCoat | None:
        """The hairs to show: those that follow, or such as still stand on this mesh."""
        coat = self._grooms[groom.id].coat
        return coat if coat is not None and coat.mesh is item.mesh and len(groom.guides) else None

    def _scene(self) -> Scene:
        options, visible = self._options, self._visible()
        coats: list[Coat] = []
        looks: dict[int, Look] = {}
        for item, groom, _ in visible:
            live = self._coat(groom, item)
            if live is None or not options.hair:
                continue
            look, widths = self._look(groom, live)
            looks.setdefault(item.id, look)
            if len(live.order):
                children = live.children
                coats.append(Coat(
                    children.points, children.ids, live.normals, look, widths=widths, order=live.order
                ))
        lines: list[GuideLines] = []
        if options.guides:
            lines = [self._grooms[groom.id].guides.lines() for _, groom, _ in visible if len(groom.guides)]
        feathers = self._feathers.shown(self._document, self._posed, self._visible_meshes())
        surfaces = []
        for item in self._visible_meshes():
            posed = self._frames.posed(item, self._frame)
            skin = skin_of(looks[item.id]) if item.id in looks else SKIN
            triangles = skin_at_rest(item.mesh, self._evaluator).triangles
            surface = Surface(
                posed.points, posed.normals, triangles.vertices, skin, self._map_values(item), "map",
                item.id in options.ghosted, self._evaluator.get(edge_vertices, item.mesh) if options.edges else None,
                item.id in looks,
            )
            if item.id not in feathers:
                surfaces.append(surface)
                continue
            skin = under_feathers(mesh for picture in feathers[item.id] for mesh in picture.quick)
            for color, part in self._evaluator.get(painted_parts, item.mesh, triangles.faces, triangles.vertices):
                surfaces.append(surface._replace(triangles=part, color=skin if color is None else color))
        pictures = [picture for found in feathers.values() for picture in found]
        return Scene(
            tuple(surfaces), tuple(coats), tuple(lines), feathers=tuple(m for p in pictures for m in p.fine),
            quick_feathers=tuple(m for p in pictures for m in p.quick),
        )

    def _look(self, groom: Groom, live: LiveCoat) -> tuple[Look, NDArray[np.float32] | None]:
        shown, traits = self._grooms[groom.id], live.children.traits
        have = shown.look
        if have is None or have[0] is not groom.coat or have[1] is not traits:
            look = look_of(groom.coat, traits)
            widths = widths_of(look, traits)
            if have is not None and widths is not None and have[3] is not None and np.array_equal(widths, have[3]):
                widths = have[3]
            have = shown.look = (groom.coat, traits, look, widths)
        return have[2], have[3]

    def _map_values(self, item: MeshObject) -> NDArray[np.float32] | None:
        """The map to show on a mesh as one value for each vertex, or None."""
        name = self._options.map
        if name is None:
            return None
        grooms = sorted(
            (g for g in self._document.grooms if g.mesh_id == item.id), key=lambda g: g.id != self._groom
        )
        found: Map | None = next((m for g in grooms if (m := g.map(name)) is not None), None)
        if found is None or (found.image is not None and item.mesh.uvs is None):
            return None
        return self._evaluator.get(at_vertices, found, item.mesh) if found.values is None else found.values


class _About(NamedTuple):
    """What hairs were asked for: those of a groom on a mesh, when there were these before."""

    groom: Groom
    item: MeshObject
    coat: LiveCoat | None


def _same_about(a: object, b: object) -> bool:
    """True when a job that failed would fail again."""
    if isinstance(a, _About) and isinstance(b, _About):
        return a.item.mesh is b.item.mesh and a.groom.coat is b.groom.coat and a.groom.maps is b.groom.maps
    if isinstance(a, Asked) and isinstance(b, Asked):
        return a.same(b)
    return a is b

