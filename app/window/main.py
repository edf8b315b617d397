"""The main window: puts the pieces in their places and gives commands what they ask for. Decides nothing else."""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike
from PySide6.QtCore import QByteArray, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import (
    QApplication,
    QDockWidget,
    QHBoxLayout,
    QMainWindow,
    QSplitter,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from app.window import keymap as keymaps
from app.window.all_commands import all_commands
from app.window.commands import Commands
from app.window.console import Console
from app.window.craft_panels import CoatPanel, RespectPanel, ToolPanel
from app.window.crash import CrashBar, CrashWatch
from app.window.desk import Desk
from app.window.feather.side import FeatherSide
from app.window.files.doors import Doors
from app.window.files.file_actions import FileActions
from app.window.files.opening import Opening
from app.window.files.playblast import PlayblastDialog
from app.window.files.recovery_bar import RecoveryBar
from app.window.files.unit_bar import UnitBar
from app.window.history_panel import HistoryPanel
from app.window.hotkeys import Hotkeys
from app.window.keymap_editor import KeymapEditor
from app.window.maps_panel import MapsPanel
from app.window.match.dope_sheet import DopeSheet
from app.window.match.model_panel import ModelPanel
from app.window.match.plate_beside import PlateBeside
from app.window.match.plate_panel import PlatePanel
from app.window.match.solve_panel import SolvePanel
from app.window.match.solve_space import SolveSpace
from app.window.match.track_list import TrackList
from app.window.match.view import PlateView
from app.window.memory import give_back_freed_memory
from app.window.outliner import Outliner
from app.window.palette import Palette
from app.window.pictures_dialog import PicturesDialog
from app.window.plugin_bar import PluginBar
from app.window.pose.controls import PoseControls
from app.window.pose.poses import PoseLibrary, PoseList
from app.window.pose.rig_panel import RigPanel
from app.window.pose.side import BesideView, PoseSide
from app.window.preferences import Preferences
from app.window.screenshot import Photographer
from app.window.sections import Column, FoldMemory, Section
from app.window.settings import Settings
from app.window.settings_keeper import SettingsKeeper
from app.window.shelf import Shelf
from app.window.status_line import StatusLine
from app.window.theme import apply, load_theme, look_of
from app.window.timeline.curve_panel import CurvePanel
from app.window.timeline.timeline import Timeline
from app.window.top_bar import TopBar
from app.window.view_host import ViewHost
from app.window.viewport_widget import Viewport
from app.window.window_commands import LEFT_OUT, PANEL_CRAFTS, PANELS, shown_panels, written_panels
from core.camera import Camera
from core.document import Document
from core.errors import UserError
from core.formats.journal import Journal
from core.gate import HD, gate_within
from core.workspace import ViewOptions, Workspace
from tools.session import Session

USUAL_SIZE = (1600, 1000)
# panels that are not in the column
AROUND = ("shelf", "timeline", "curves", "pose_map", "feather", "space", "beside", "dope")
COLUMN_WIDTH = 26  # of the column at the right, in heights of the text


class MainWindow(QMainWindow):
    """The window. Implements what :class:`app.window.commands.Window` asks for.

    Parameters
    ----------
    settings : the preferences to begin with. folder : where preferences are kept; None for the usual one.
    """

    def __init__(self, session: Session, settings: Settings, folder: Path | None = None) -> None:
        super().__init__()
        self._settings, self._folder = settings, folder
        self.desk = Desk(session, self)
        self._keeper = SettingsKeeper(self.desk, folder)
        self.commands = Commands(self)
        self.commands.add(all_commands(session.tools))
        loaded = keymaps.load(settings.keymap, folder)
        self.hotkeys = Hotkeys(self, self.commands, loaded.keymap)
        self.opening = Opening(
            self.desk, self, self.make_session, self.remember, lambda path: self.match.doors.open_plate(path))
        self.files = FileActions(self)
        self.crash_watch = CrashWatch(parent=self)
        self.photographer: Photographer | None = None
        self._keeps_place = True
        self.viewport = Viewport(self.desk, self.hotkeys, self.commands, self, settings.density_ms)
        self.viewport.plate.screen.set_budget(settings.frames_mb << 20)
        self.top = TopBar(self.desk, self.commands, self.hotkeys)
        self.shelf = Shelf(self.desk, lambda tool: self.hotkeys.keymap.shown(f"tool.{tool}"))
        self.view = ViewHost(self.viewport, self)
        self.doors = Doors(self.desk, self.opening, lambda: self._settings.recent)
        self.middle = QStackedWidget()
        self.recovery = RecoveryBar(self.desk)
        self.unit = UnitBar(self.desk, self.opening.read_as)
        self.opening.assumed.connect(self.unit.offer)
        self.crash = CrashBar(self.crash_watch)
        self.plugins = PluginBar(session.tools.troubles)
        self.status = StatusLine(self.desk, self.hotkeys)
        self.timeline = Timeline(self.desk, speed=self.match.play_speed)
        self.curves = CurvePanel(self.desk, self.commands, self.hotkeys)
        self.dope_sheet = DopeSheet(self.desk, self.timeline.ruler)
        self.pose_side = PoseSide(self.desk)
        self.feather_side = FeatherSide(self.desk, self.viewport.draw_beside, FoldMemory(self._folder))
        self.solve_space = SolveSpace(
            self.desk, lambda: self.hotkeys.keymap, lambda: self.viewport.eye.trackball, self.match.screen)
        self.plate_beside = PlateBeside(self.desk)
        self.plate_beside.set_budget(settings.frames_mb << 20)
        self.panels: dict[str, QWidget] = {
            "shelf": self.shelf, "timeline": self.timeline, "curves": self.curves, "pose_map": self.pose_side,
            "feather": self.feather_side, "space": self.solve_space, "beside": self.plate_beside,
            "dope": self.dope_sheet}
        self.column = self._make_column()
        self._console: QDockWidget | None = None
        self._preferences: Preferences | None = None
        self._lay_out()
        self._assist_commands()
        self.setAcceptDrops(True)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.doors.needed.connect(lambda empty: self._show_middle())
        self.desk.session_replaced.connect(self._take_session)
        self.desk.changed.connect(self._document_changed)
        self.desk.workspace_changed.connect(self._workspace_changed)
        self.timeline.playback.changed.connect(self._playback_changed)
        self.timeline.curves.clicked.connect(lambda: self.commands.run("window.curves"))
        self.viewport.failed.connect(self.view.show_trouble)
        self.viewport.hint.connect(self.status.show_doing)
        self.curves.hint.connect(self.status.show_doing)
        self.viewport.settled.connect(self._show_cached)
        if loaded.trouble:
            self.desk.error(UserError(loaded.trouble))
        self._take_session()

    # -- how it is put together --------------------------------------------------------------------------

    def _make_column(self) -> Column:
        memory, column = FoldMemory(self._folder), Column()
        self.outliner = Outliner(self.desk, reload=lambda mesh_id, ask: self.files.reload_mesh(None, mesh_id, ask))
        self.solve_panel = SolvePanel(self.desk, self.match.solving)
        self.solve_panel.space.clicked.connect(lambda checked=False: self.commands.run("window.space"))
        made: tuple[tuple[str, QWidget], ...] = (
            ("scene", Section(PANELS["scene"][0], self.outliner, memory, "scene")),
            ("tool", ToolPanel(self.desk, memory)),
            ("controls", Section(PANELS["controls"][0], PoseControls(self.desk), memory, "controls")),
            ("poses", Section(PANELS["poses"][0], PoseList(self.desk), memory, "poses")),
            ("library", Section(PANELS["library"][0], PoseLibrary(self.desk), memory, "library")),
            ("rig", Section(PANELS["rig"][0], RigPanel(self.desk), memory, "rig")),
            ("respect", RespectPanel(self.desk, memory)),
            ("tracks", Section(PANELS["tracks"][0], TrackList(self.desk), memory, "tracks")),
            ("solve", Section(PANELS["solve"][0], self.solve_panel, memory, "solve")),
            ("model", Section(PANELS["model"][0], ModelPanel(self.desk, self.match.model), memory, "model")),
            ("plate", Section(PANELS["plate"][0], PlatePanel(self.desk, memory), memory, "plate")),
            ("coat", CoatPanel(self.desk, memory)),
            ("maps", Section(PANELS["maps"][0], MapsPanel(self.desk), memory, "maps")),
            ("history", Section(PANELS["history"][0], HistoryPanel(self.desk), memory, "history")),
        )
        for name, panel in made:
            column.add(panel)
            self.panels[name] = panel
        return column

    def _lay_out(self) -> None:
        self.split = QSplitter(Qt.Orientation.Horizontal)
        self.split.setChildrenCollapsible(False)
        self.sides: QWidget = self.view
        for side in (self.pose_side, self.feather_side, self.solve_space, self.plate_beside):
            self.sides = BesideView(self.sides, side)
        self.middle.addWidget(self.sides)
        self.middle.addWidget(self.doors)
        self.split.addWidget(self.middle)
        self.split.addWidget(self.column)
        self.split.setStretchFactor(0, 1)
        self.split.setStretchFactor(1, 0)
        self.split.setHandleWidth(look_of().grid)
        upper = QWidget()
        across = QHBoxLayout(upper)
        across.setContentsMargins(0, 0, 0, 0)
        across.setSpacing(0)
        across.addWidget(self.shelf)
        across.addWidget(self.split, 1)
        whole = QWidget()
        down = QVBoxLayout(whole)
        down.setContentsMargins(0, 0, 0, 0)
        down.setSpacing(0)
        for bar in (self.top, self.recovery, self.unit, self.crash, self.plugins):
            down.addWidget(bar)
        over = QSplitter(Qt.Orientation.Vertical)
        over.setChildrenCollapsible(False)
        over.setHandleWidth(look_of().grid)
        over.addWidget(upper)
        over.addWidget(self.curves)
        over.addWidget(self.dope_sheet)
        for place, share in enumerate((1, 0, 0)):
            over.setStretchFactor(place, share)
        down.addWidget(over, 1)
        down.addWidget(self.timeline)
        down.addWidget(self.status)
        self.setCentralWidget(whole)
        self.resize(*USUAL_SIZE)
        self._usual_split()
        self._restore(self._settings)

    def _usual_split(self) -> None:
        wide = COLUMN_WIDTH * look_of().text
        self.split.setSizes([max(self.width() - wide - self.shelf.sizeHint().width(), 100), wide])

    def _scale_column(self, factor: float) -> None:
        """The panels need more room for larger letters, up to half of the window."""
        middle, column = self.split.sizes()
        wide = min(round(column * factor), (middle + column) // 2)
        self.split.setSizes([middle + column - wide, wide])

    def _restore(self, settings: Settings) -> None:
        if settings.geometry:
            self.restoreGeometry(QByteArray(base64.b64decode(settings.geometry)))
        if settings.panels:
            self.split.restoreState(QByteArray(base64.b64decode(settings.panels)))

    def _assist_commands(self) -> None:
        """Files are a piece of their own; commands find what it does at the window."""
        files, opening = self.files, self.opening
        self.new_document, self.save, self.save_as, self.save_copy = (
            files.new_document, files.save, files.save_as, files.save_copy)
        self.show_recent, self.reload_mesh, self.export_coat = files.show_recent, files.reload_mesh, files.export_coat
        self.save_screenshot, self.save_macro, self.play_macro = (
            files.save_screenshot, files.save_macro, files.play_macro)
        self.choose_background, self.pin_reference = files.choose_background, files.pin_reference
        self.restart_safe, self.import_mesh = files.restart_safe, opening.ask_import
        self.camera_from_file, self.import_sculpt = files.camera_from_file, files.import_sculpt

    def make_session(self, document: Document | None = None, *args: Any, **settings: Any) -> Session:
        """A session for this window: with a journal, so that a crash loses nothing, and with its tools."""
        journal = Journal(hashes=settings.get("hashes"))
        if not args and "workspace" not in settings:
            settings["workspace"] = fresh_workspace()
        return Session(document, *args, journal=journal, tools=self.desk.session.tools, **settings)

    def remember(self, path: Path) -> None:
        """A file was opened or saved: it leads the recent ones."""
        self.change_settings(recent=self._settings.opened(path).recent)

    # -- what commands ask for ---------------------------------------------------------------------------

    @property
    def settings(self) -> Settings:
        """The preferences now."""
        return self._settings

    @property
    def match(self) -> PlateView:
        """The plate in the view."""
        return self.viewport.plate

    @property
    def playing(self) -> bool:
        """True during playback."""
        return self.timeline.playback.playing

    def open_file(self, path: Path | None = None) -> None:
        """Open a project or a mesh; asks for it when it is not given."""
        if path is None:
            self.opening.ask()
        else:
            self.opening.open(path)

    def open_bare_bird(self) -> None:
        """Open the project's own bird without feathers."""
        self.opening.open_bare_bird()

    def make_playblast(self) -> None:
        """Ask for a playblast beside the work."""
        (width, height), view = self.viewport.pixels(), self.desk.workspace.view
        if view.gate is not None and view.gate_shown:
            height = max(2 * round(0.5 * width / view.gate.aspect), 16)
        dialog = PlayblastDialog(self.desk, self.viewport.draw_frame, (width, height), self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.show()

    def look(self, camera: Camera) -> None:
        """Look through a camera."""
        self.viewport.eye.look(camera)

    def look_from(self, side: str) -> None:
        """Turn to a side of the animal."""
        self.viewport.eye.look_from(side)

    def frame_all(self) -> None:
        """See everything."""
        self.viewport.eye.frame_all()

    def frame_selected(self) -> None:
        """See the selected guides."""
        self.viewport.eye.frame_selected()

    def view_of(self, points: ArrayLike, outward: ArrayLike) -> Camera:
        """A camera on points (N, 3) from outside."""
        return self.viewport.eye.view_of(points, outward)

    def toggle_projection(self) -> None:
        """A lens or parallel rays."""
        self.viewport.eye.toggle_projection()

    def toggle_gate(self) -> None:
        """Show or hide the film gate; the first time one of the present view."""
        view, (width, height) = self.desk.workspace.view, self.viewport.pixels()
        shown = view.replace(gate_shown=not view.gate_shown) if view.gate is not None else view.replace(
            gate=gate_within(self.viewport.eye.camera, HD, width / height), gate_shown=True)
        self.desk.set_workspace(view=shown)

    def scale_density(self, factor: float) -> None:
        """More or fewer hairs while the hand moves."""
        self.viewport.scale_density(factor)

    def toggle_playback(self) -> None:
        """Play or stop."""
        self.timeline.playback.toggle()

    def toggle_floating_view(self) -> None:
        """The viewport in a window of its own, or back."""
        if self.view.floating:
            self.view.dock()
        else:
            self.view.float_out()

    def toggle_panel(self, name: str) -> None:
        """Show or hide a panel."""
        self.desk.set_workspace(panels=written_panels({name} ^ set(shown_panels(self.desk.workspace.panels))))

    def reset_layout(self) -> None:
        """Every panel where it was at first."""
        self.desk.set_workspace(panels=written_panels(shown_panels(())))
        self.view.dock()
        self._usual_split()

    def toggle_full_screen(self) -> None:
        """Fill the screen, or not."""
        if self.isFullScreen():
            self.showNormal()
        else:
            self.showFullScreen()

    def show_palette(self) -> None:
        """Find a command by words."""
        Palette(self, self.commands, self.hotkeys.keymap).open_over(self)

    def show_preferences(self) -> None:
        """The preferences beside the window."""
        if self._preferences is None:
            self._preferences = Preferences(self, self)
            self._preferences.destroyed.connect(self._preferences_gone)
        self._preferences.show()
        self._preferences.raise_()
        self._preferences.activateWindow()

    def show_pictures(self) -> None:
        """Place and size of the pictures in the view, by numbers."""
        PicturesDialog(self, self.desk).show()

    def show_keymap_editor(self) -> None:
        """The hotkeys beside the window."""
        editor = KeymapEditor(self, self.commands, self.hotkeys.keymap, self._settings.keymap, self._folder)
        editor.changed.connect(self._keymap_changed)
        editor.preset_chosen.connect(lambda name: self.change_settings(keymap=name))
        editor.failed.connect(self.desk.error)
        editor.show()

    def show_console(self) -> None:
        """Python at the bottom of the window, ready to type in, or away with it."""
        opens = self._console is None or not self._console.isVisible()
        if self._console is None:
            self._console = QDockWidget("Python", self)
            self._console.setObjectName("console")
            self._console.setWidget(Console(self.desk))
            self.addDockWidget(Qt.DockWidgetArea.BottomDockWidgetArea, self._console)
            self.resizeDocks([self._console], [self.height() // 4], Qt.Orientation.Vertical)
        else:
            self._console.setVisible(opens)
        if opens:
            self.activateWindow()  # the view is a window of its own, whose hotkeys the letters would be
            self._console.widget().setFocus()
        else:
            self.viewport.requestActivate()

    def change_settings(self, **changes: Any) -> None:
        """Take other preferences at once, and keep them."""
        old, self._settings = self._settings, self._settings.replace(**changes)
        new = self._settings
        self._keeper.keep(new)
        if (old.theme, old.text_size) != (new.theme, new.text_size):
            application = QApplication.instance()
            assert isinstance(application, QApplication)
            apply(application, load_theme(new.theme), new.text_size)
            self._take_look()
            self._scale_column(new.text_size / old.text_size)
        if old.keymap != new.keymap:
            self._keymap_changed(keymaps.load(new.keymap, self._folder).keymap)
        if old.unit != new.unit:
            self._show_unit()
        self.desk.session.history.budget = new.history_mb << 20
        self.viewport.set_budget(new.density_ms)
        self.match.screen.set_budget(new.frames_mb << 20)
        self.plate_beside.set_budget(new.frames_mb << 20)
        self._use_pen()
        if self._preferences is not None:
            self._preferences.refresh()

    # -- what the start asks for -------------------------------------------------------------------------

    @property
    def settled(self) -> bool:
        """True when nothing goes on: no job, no picture to be finished."""
        if self.desk.jobs.running or self.desk.session.stroking:
            return False
        return self.viewport.at_rest or not self.view.shows_picture

    def when_settled(self, call: Callable[[], object]) -> None:
        """Call something once, as soon as nothing goes on."""
        def look() -> None:
            if self.settled:
                timer.stop()
                call()

        timer = QTimer(self, interval=50)
        timer.timeout.connect(look)
        timer.start()

    def offer_lost_work(self) -> None:
        """Offer what a killed program left behind, and say what it died of; nothing waits for the answer."""
        self.crash_watch.install()
        self.commands.noted = self.crash_watch.note
        self.crash.tell_of_last_run(self.crash_watch)
        self.recovery.look()

    def close_unasked(self) -> None:
        """Leave without a trace in the preferences or the journal: for a picture of the window."""
        self._keeps_place = False
        self.close()

    # -- what changes ------------------------------------------------------------------------------------

    def _show_panels(self) -> None:
        visible = shown_panels(self.desk.workspace.panels)
        craft = self.desk.session.tool.craft
        shown = {
            name for name in visible
            if craft in PANEL_CRAFTS.get(name, (craft,)) and name not in LEFT_OUT.get(craft, ())}
        for name, panel in self.panels.items():
            panel.setVisible(name in shown)
        self.column.setVisible(any(name in shown for name in self.panels if name not in AROUND))

    def _show_title(self) -> None:
        session = self.desk.session
        name = session.path.name if session.path is not None else "New"
        self.setWindowTitle(f"{name}[*] – filoplume")
        self.setWindowModified(not session.saved)

    def _show_middle(self) -> None:
        something = bool(self.desk.document.meshes or self.desk.document.plates)
        self.middle.setCurrentWidget(self.sides if something else self.doors)
        # hidden doors must not keep the view as wide as they are, nor push the column out of a small window
        self.doors.setMinimumWidth(1 if something else 0)
        self.split.updateGeometry()  # doors that are hidden do not tell the layouts above
        self.status.show_hint()

    def show_saved(self) -> None:
        """The work is in its file now."""
        self._show_title()
        self.top.refresh()

    def _show_unit(self) -> None:
        for panel in self.panels.values():
            if isinstance(panel, ToolPanel | RespectPanel | CoatPanel):
                panel.set_unit(self._settings.unit)

    def _show_cached(self) -> None:
        if self.match.shown:
            self.timeline.set_cached(self.match.screen.held())
        elif self.viewport.picture is not None:
            self.timeline.set_cached(self.viewport.picture.live.cached_frames(self.desk.document))

    def _take_session(self) -> None:
        self._use_pen()
        self.desk.session.history.budget = self._settings.history_mb << 20
        self._show_panels()
        self._show_title()
        self._show_middle()
        self.when_settled(give_back_freed_memory)

    def _document_changed(self, old: Document, new: Document) -> None:
        if self.desk.session.stroking:
            return
        self._show_title()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.panels != new.panels or old.craft != new.craft:
            self._show_panels()
            self.status.show_hint()

    def _playback_changed(self) -> None:
        self.viewport.playing = self.playing
        self.viewport.redraw()

    def _keymap_changed(self, keymap: keymaps.Keymap) -> None:
        self.hotkeys.set_keymap(keymap)
        self.shelf.rebuild()
        self.status.show_hint()
        self.top.update()

    def _take_look(self) -> None:
        self.top.take_look()
        self.hotkeys.take_look()
        self.status.show_hint()
        self.viewport.repaint_soon()

    def _preferences_gone(self) -> None:
        self._preferences = None

    def _use_pen(self) -> None:
        self.desk.session.hand.pen = self._settings.pen
        self.viewport.eye.trackball = self._settings.orbit == "trackball"

    # -- events ------------------------------------------------------------------------------------------

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Files may be dropped."""
        if self.opening.takes(event.mimeData()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """A project or a mesh is opened, a picture is pinned to the view."""
        event.acceptProposedAction()
        self.opening.dropped(event.mimeData().urls())

    def closeEvent(self, event: QCloseEvent) -> None:
        """Nothing is asked: what is not saved is in the journal and offered at the next start."""
        self.timeline.playback.pause()
        self.desk.end_stroke()
        self.view.dock()
        if self._keeps_place:
            self.change_settings(geometry=_text(self.saveGeometry()), panels=_text(self.split.saveState()))
        self.desk.jobs.close()
        self._keeper.close()
        self.viewport.release_gl()
        self.viewport.plate.close()
        self.plate_beside.close_frames()
        self.desk.session.changed = None
        self.desk.session.close(discard=not self._keeps_place)
        self.crash_watch.close()
        give_back_freed_memory()
        event.accept()


def fresh_workspace() -> Workspace:
    """Where a new document begins: with the comb, the coat as it is; guides show themselves when they are meant."""
    return Workspace(tool="comb", panels=written_panels(shown_panels(())), view=ViewOptions(guides=False))


def _text(data: QByteArray) -> str:
    return base64.b64encode(data.data()).decode()
