"""The outliner: meshes with their grooms; what is chosen here is what tools edit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from PySide6.QtCore import QEvent, QModelIndex, QPersistentModelIndex, QPoint, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QFontMetricsF, QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QMenu,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeView,
    QWidget,
)

from app.window.desk import Desk
from app.window.feather_coats import FEATHERS, dress_with_feathers
from app.window.icons import icon, paint_icon
from app.window.jobs import Asked, Progress
from app.window.scene_model import ITEM, Item, SceneModel, counted
from app.window.theme import look_of, text_font
from core.document import Document, MeshObject, feathers_of, find_mesh
from core.errors import UserError
from core.feather.presets import bird_names, load_bird
from core.groom.groom import Groom
from core.groom.style import load_style, style_names
from core.workspace import Workspace
from tools.document_edits import (
    add_empty_groom,
    add_groom,
    dressed,
    remove_feathers_with_keys,
    remove_groom,
    remove_mesh,
    set_groom_hidden,
    set_groom_locked,
    set_mesh_hidden,
    set_mesh_locked,
)

_STAGES = 4  # of dressing a mesh, about
Index = QModelIndex | QPersistentModelIndex
MOST_ROWS = 7  # that are shown without scrolling


class Rows(QStyledItemDelegate):
    """Draws a row: icon, name, count; eye and lock at the right, when they say something or are near."""

    def __init__(self, tree: Outliner) -> None:
        super().__init__(tree)
        self._tree = tree

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        look, item = look_of(), index.data(ITEM)
        area = QRectF(option.rect)
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        over = bool(option.state & QStyle.StateFlag.State_MouseOver)
        painter.save()
        if chosen or over:
            painter.fillRect(option.rect, look.theme.colour("accent_ground" if chosen else "hover"))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        mesh = self._tree.mesh_of(item)
        colour = "accent" if chosen else "dim" if mesh.hidden or item.hidden else "text"
        side = float(look.icon - 4)
        paint_icon(painter, self._tree.picture_of(item),
                   QRectF(area.left() + 2, area.center().y() - side / 2, side, side),
                   look.theme.colour("accent" if chosen else "dim"))
        inside = area.adjusted(side + 8, 0, -2.0 * look.icon, 0)
        painter.setFont(text_font(look))
        metrics = QFontMetricsF(painter.font())
        words = counted(item)
        room = max(0.4 * inside.width(), inside.width() - metrics.horizontalAdvance(words) - look.gap)
        name = metrics.elidedText(item.name, Qt.TextElideMode.ElideRight, room)
        painter.setPen(look.theme.colour(colour))
        painter.drawText(inside, Qt.AlignmentFlag.AlignVCenter, name)
        rest = inside.adjusted(metrics.horizontalAdvance(name) + look.gap, 0, 0, 0)
        painter.setPen(look.theme.colour("accent" if chosen else "dim"))
        if rest.width() > 0:
            painter.drawText(rest, Qt.AlignmentFlag.AlignVCenter,
                             metrics.elidedText(words, Qt.TextElideMode.ElideRight, rest.width()))
        eye, lock = self.buttons(option.rect)
        if over or item.hidden:
            paint_icon(painter, "eye-off" if item.hidden else "eye", eye,
                       look.theme.colour("text" if item.hidden else "dim"))
        if over or item.locked:
            paint_icon(painter, "lock" if item.locked else "unlock", lock,
                       look.theme.colour("text" if item.locked else "dim"))
        painter.restore()

    @staticmethod
    def buttons(area: QRect) -> tuple[QRectF, QRectF]:
        """Where eye and lock of a row are."""
        look = look_of()
        side = float(look.icon - 4)
        top = area.center().y() - side / 2 + 0.5
        right = area.right() - 2.0
        return QRectF(right - 2 * side - 6, top, side, side), QRectF(right - side, top, side, side)

    def updateEditorGeometry(self, editor: QWidget, option: QStyleOptionViewItem, index: Index) -> None:
        editor.setGeometry(option.rect.adjusted(look_of().icon, 0, 0, 0))


class Outliner(QTreeView):
    """The tree of the scene."""

    def __init__(
        self, desk: Desk, parent: QWidget | None = None, reload: Callable[[int, bool], object] | None = None,
    ) -> None:
        super().__init__(parent)
        self._desk = desk
        self.reload = reload  # reads the updated file of a mesh, asking for it or not
        self._folded: set[int] = set()
        self._following = False
        self.scene = SceneModel(desk)
        self.setModel(self.scene)
        self.rows = Rows(self)
        self.setItemDelegate(self.rows)
        self.setHeaderHidden(True)
        self.setUniformRowHeights(True)
        self.setIndentation(look_of().gap * 2)
        self.setMouseTracking(True)
        self.setEditTriggers(
            QAbstractItemView.EditTrigger.DoubleClicked | QAbstractItemView.EditTrigger.EditKeyPressed)
        self.setExpandsOnDoubleClick(False)
        self.setDragDropMode(QAbstractItemView.DragDropMode.InternalMove)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.setAccessibleName("Scene")
        self.customContextMenuRequested.connect(self._open_menu)
        self.collapsed.connect(lambda index: self._fold(index, True))
        self.expanded.connect(lambda index: self._fold(index, False))
        self.selectionModel().currentChanged.connect(self._chosen)
        desk.changed.connect(self._changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.stroke_ended.connect(self.refresh)
        desk.session_replaced.connect(self.refresh)
        for changed in (self.collapsed, self.expanded, self.scene.modelReset, self.scene.rowsInserted,
                        self.scene.rowsRemoved):
            changed.connect(self.updateGeometry)
        self.expandAll()
        self._mark_active()

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(20 * look.text, MOST_ROWS * look.row)

    def minimumSizeHint(self) -> QSize:
        """Room for the rows there are, up to so many, at the text size of the moment."""
        index, rows = self.scene.index(0, 0), 0
        while index.isValid() and rows < MOST_ROWS:
            index, rows = self.indexBelow(index), rows + 1
        return QSize(10 * look_of().text, max(rows, 2) * max(self.sizeHintForRow(0), look_of().row) + 4)

    def mesh_of(self, item: Item) -> MeshObject:
        """The mesh itself, or the one a groom grows on."""
        return item if isinstance(item, MeshObject) else find_mesh(self._desk.document, item.mesh_id)

    def picture_of(self, item: MeshObject | Groom) -> str:
        """The icon of a row: of a mesh, of hair, or of feathers whose keys a groom holds."""
        if isinstance(item, MeshObject):
            return "mesh"
        return "groom" if feathers_of(self._desk.document, item) is None else "feather"

    @property
    def chosen(self) -> Item | None:
        """What the row under the hand's last click stands for."""
        return self.scene.item(self.currentIndex())

    def refresh(self) -> None:
        """Show the document as it is; nothing while a stroke goes on."""
        if self._desk.session.stroking:
            return
        self._following = True
        try:
            before = self.chosen
            if self.scene.follow(self._desk.document):
                self.expandAll()
                for item in self._desk.document.meshes:
                    if item.id in self._folded:
                        self.collapse(self.scene.index_of(item))
                if isinstance(before, MeshObject):
                    self.setCurrentIndex(self.scene.index_of(before))
        finally:
            self._following = False
        self._mark_active()

    # -- following -------------------------------------------------------------------------------------------

    def _changed(self, old: Document, new: Document) -> None:
        if not self._desk.session.stroking and (old.meshes is not new.meshes or old.grooms is not new.grooms):
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.groom != new.groom:
            self._mark_active()

    def _mark_active(self) -> None:
        """Let the row of the active groom be the current one, unless its mesh is; its mesh where that is folded."""
        groom = self._desk.groom
        current = self.chosen
        if groom is None or (isinstance(current, MeshObject) and current.id == groom.mesh_id):
            return
        self._following = True
        try:
            folded = groom.mesh_id in self._folded
            self.setCurrentIndex(self.scene.index_of(self.mesh_of(groom) if folded else groom))
        finally:
            self._following = False

    def _fold(self, index: QModelIndex, folded: bool) -> None:
        item = self.scene.item(index)
        if item is not None and not self._following:
            (self._folded.add if folded else self._folded.discard)(item.id)

    def _chosen(self, index: QModelIndex) -> None:
        item = self.scene.item(index)
        if self._following or item is None:
            return
        groom = self._desk.groom
        if isinstance(item, Groom):
            self._desk.set_workspace(groom=item.id)
        elif groom is None or groom.mesh_id != item.id:
            grooms = self.scene.grooms_on(item.id)
            if grooms:
                self._desk.set_workspace(groom=grooms[0].id)

    # -- the hand --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        index = self.indexAt(event.position().toPoint())
        item = self.scene.item(index)
        if item is not None and event.button() == Qt.MouseButton.LeftButton:
            eye, lock = self.rows.buttons(self.visualRect(index))
            if eye.contains(event.position()):
                self.toggle_hidden(item)
                return
            if lock.contains(event.position()):
                self.toggle_locked(item)
                return
        super().mousePressEvent(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        index = self.indexAt(event.position().toPoint())
        if index.isValid() and any(b.contains(event.position()) for b in self.rows.buttons(self.visualRect(index))):
            self.mousePressEvent(event)
            return
        super().mouseDoubleClickEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and self.state() != self.State.EditingState:
            self.delete(self.chosen)
        else:
            super().keyPressEvent(event)

    def event(self, event: QEvent) -> bool:
        # a hotkey of the same key elsewhere must not take Delete from under the hand
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and event.key() in (
                Qt.Key.Key_Delete, Qt.Key.Key_Backspace, Qt.Key.Key_F2):
            event.accept()
            return True
        return super().event(event)

    def viewportEvent(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip and not self.indexAt(event.pos()).isValid():  # type: ignore[attr-defined]
            return False
        if event.type() == QEvent.Type.ToolTip:
            item = self.scene.item(self.indexAt(event.pos()))  # type: ignore[attr-defined]
            self.setToolTip(_about(item))
        return super().viewportEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if not self._desk.document.meshes:
            look = look_of()
            painter = QPainter(self.viewport())
            painter.setFont(text_font(look))
            painter.setPen(look.theme.colour("dim"))
            painter.drawText(self.viewport().rect().adjusted(4, 4, -4, -4),
                             Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap,
                             "Nothing here yet: open or import a mesh.")

    # -- what it does ----------------------------------------------------------------------------------------

    def toggle_hidden(self, item: Item) -> None:
        """Hide a mesh with its grooms or one groom, or show it."""
        change = set_mesh_hidden if isinstance(item, MeshObject) else set_groom_hidden
        self._desk.edit("Show" if item.hidden else "Hide", change, item.id, not item.hidden)

    def toggle_locked(self, item: Item) -> None:
        """Keep tools off a mesh and its grooms or off one groom, or let them."""
        change = set_mesh_locked if isinstance(item, MeshObject) else set_groom_locked
        self._desk.edit("Unlock" if item.locked else "Lock", change, item.id, not item.locked)

    def delete(self, item: Item | None) -> None:
        """Delete a mesh with its grooms, or a groom with the feathers it holds the keys of; undo brings it back."""
        if isinstance(item, MeshObject):
            self._desk.edit("Delete mesh", remove_mesh, item.id)
        elif (feathers := feathers_of(self._desk.document, item)) is not None:
            self._desk.edit("Delete feathers", remove_feathers_with_keys, feathers.id)
        elif item is not None:
            self._desk.edit("Delete groom", remove_groom, item.id)

    def toggle_isolated(self, item: MeshObject) -> None:
        """Show this mesh alone with its grooms, or everything again."""
        view = self._desk.workspace.view
        alone = () if view.isolated == (item.id,) else (item.id,)
        self._desk.set_workspace(view=view.replace(isolated=alone))

    def toggle_ghosted(self, item: MeshObject) -> None:
        """Show this mesh translucent, or solid again."""
        view = self._desk.workspace.view
        others = tuple(i for i in view.ghosted if i != item.id)
        ghosted = others if item.id in view.ghosted else (*others, item.id)
        self._desk.set_workspace(view=view.replace(ghosted=ghosted))

    def add_groom(self, item: MeshObject, style: str | None) -> None:
        """Lay a first groom on a mesh by a style, beside the window; without a style an empty one at once."""
        desk = self._desk
        if style is None:
            if desk.edit("Add groom", add_empty_groom, item.id, "coat"):
                desk.set_workspace(groom=desk.document.grooms[-1].id)
            return
        document, evaluator = desk.document, desk.session.evaluator

        def work(progress: Progress, cancelled: Asked) -> Groom:
            done = 0

            @contextmanager
            def stage(name: str) -> Iterator[None]:
                nonlocal done
                progress(done / _STAGES)
                yield
                done += 1

            return dressed(document, item.id, style, evaluator, stage=stage)

        def put(groom: Groom) -> None:
            if all(other.mesh is not item.mesh for other in desk.document.meshes):
                raise UserError(f"The mesh {item.name} was changed meanwhile; add the groom again.")
            if desk.edit("Add groom", add_groom, groom):
                desk.set_workspace(groom=desk.document.grooms[-1].id)

        desk.jobs.start(f"Lay a {style} coat on {item.name}", work, put, owner=self)

    def menu(self, index: QModelIndex) -> QMenu:
        """The context menu of a row."""
        menu, item = QMenu(self), self.scene.item(index)
        menu.setToolTipsVisible(True)

        def add(to: QMenu, words: str, picture: str | None, tip: str, run: Callable[[], object],
                on: bool | None = None) -> None:
            action = to.addAction(words)
            if picture is not None:
                action.setIcon(icon(picture))
            action.setToolTip(tip)
            if on is not None:
                action.setCheckable(True)
                action.setChecked(on)
            action.triggered.connect(lambda: run())

        if item is None:
            return menu
        mesh, view = self.mesh_of(item), self._desk.workspace.view
        add(menu, "Rename\tF2", None, "Gives it another name; a double click does too.", lambda: self.edit(index))
        whole = isinstance(item, MeshObject)
        add(menu, "Show" if item.hidden else "Hide", "eye" if item.hidden else "eye-off",
            "Leaves the mesh and its hair out of the view, in the project too." if whole else
            "Leaves the groom out of the view, of pictures and of exports.", lambda: self.toggle_hidden(item))
        add(menu, "Unlock" if item.locked else "Lock", "unlock" if item.locked else "lock",
            "Keeps every tool off the mesh and its grooms." if whole else "Keeps every tool off the groom.",
            lambda: self.toggle_locked(item))
        add(menu, "Isolate", "isolate", "Shows only this mesh with its grooms; again shows everything.",
            lambda: self.toggle_isolated(mesh), view.isolated == (mesh.id,))
        add(menu, "Ghost", "ghost", "Shows the mesh translucent, so that you see what lies behind.",
            lambda: self.toggle_ghosted(mesh), mesh.id in view.ghosted)
        if isinstance(item, MeshObject) and self.reload is not None:
            read: Callable[[int, bool], object] = self.reload
            number: int = item.id
            if item.source:
                add(menu, "Reload", "reload", f"Reads {item.source} again; the hair comes along.",
                    lambda: read(number, False))
            add(menu, "Reload from…" if item.source else "Reload…", "reload",
                "Reads an updated file in its place; the hair comes along.", lambda: read(number, True))
        menu.addSeparator()
        more = menu.addMenu(icon("plus"), "Add groom")
        more.setToolTipsVisible(True)
        add(more, "Empty", None, "A groom without guides, to plant by hand.", lambda: self.add_groom(mesh, None))
        for style in style_names():
            add(more, style.capitalize(), None, load_style(style).description,
                lambda style=style: self.add_groom(mesh, style))
        birds = menu.addMenu(icon("plus"), "Dress with feathers")
        birds.setToolTipsVisible(True)
        for bird in bird_names():
            add(birds, load_bird(bird).title, None, f"{FEATHERS:,} feathers that follow keys you comb like guides.",
                lambda bird=bird: dress_with_feathers(self._desk, mesh, bird, self))
        menu.addSeparator()
        add(menu, "Delete\tDel", "delete", "Takes it out of the document; undo brings it back.",
            lambda: self.delete(item))
        return menu

    def _open_menu(self, place: QPoint) -> None:
        index = self.indexAt(place)
        if index.isValid():
            menu = self.menu(index)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            menu.popup(self.viewport().mapToGlobal(place))


def _about(item: Item | None) -> str:
    if item is None:
        return ""
    if isinstance(item, MeshObject):
        moves = ", moved by a rig" if item.rig is not None else ""
        return (f"{item.name}: {counted(item)}, {len(item.mesh.points):,} vertices{moves}. "
                "Double click renames, dragging reorders, eye and lock are at the right.")
    hairs = f", {item.coat.count:,} hairs" if item.coat.count else ""
    return f"{item.name}: {counted(item)}{hairs}. Click to work on it with the tools."
