"""The maps of the active groom: made, painted, loaded, given to density and length, shown on the skin, laid flat."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QFontMetricsF, QKeyEvent, QMouseEvent, QPainter
from PySide6.QtWidgets import (
    QHBoxLayout,
    QListWidget,
    QPushButton,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from app.window.desk import Desk
from app.window.fields.combo import Combo
from app.window.files.opening import PICTURE_SUFFIXES, choose_file, filter_of
from app.window.icons import paint_icon
from app.window.sections import Row
from app.window.theme import look_of, text_font
from app.window.uv_view import UvView
from core.document import Document, find_groom
from core.groom.groom import COAT_FIELDS, Map
from core.workspace import Workspace
from tools.document_edits import add_flat_map, map_from_image, remove_map, set_coat, set_map
from tools.map_edits import DENSITY, ROLES, paintable_copy, painted_name

NO_MAP = {"density_map": "none · even", "length_map": "none · as guides"}  # by role
PAINT = "paint_map"  # the tool


class _Rows(QStyledItemDelegate):
    """Icon, name, what it is and drives; an eye at the right that shows it on the skin."""

    def __init__(self, panel: MapsPanel) -> None:
        super().__init__(panel)
        self._panel = panel

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex) -> QSize:
        return QSize(0, look_of().row - look_of().grid)

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        look, name = look_of(), index.data()
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        over = bool(option.state & QStyle.StateFlag.State_MouseOver)
        shown = self._panel.overlay == name
        painter.save()
        if chosen or over:
            painter.fillRect(option.rect, look.theme.colour("accent_ground" if chosen else "hover"))
        area, side = QRectF(option.rect), float(look.icon - 4)
        paint_icon(painter, "map", QRectF(area.left() + 2, area.center().y() - side / 2, side, side),
                   look.theme.colour("accent" if chosen else "dim"))
        eye = self.eye(area)
        if shown or over:
            paint_icon(painter, "eye", eye, look.theme.colour("accent" if shown else "dim"))
        inside = QRectF(area.left() + side + 8, area.top(), eye.left() - area.left() - side - 12, area.height())
        painter.setFont(text_font(look))
        metrics = QFontMetricsF(painter.font())
        words = metrics.elidedText(name, Qt.TextElideMode.ElideRight, inside.width())
        painter.setPen(look.theme.colour("accent" if chosen else "text"))
        painter.drawText(inside, Qt.AlignmentFlag.AlignVCenter, words)
        rest = inside.adjusted(metrics.horizontalAdvance(words) + look.gap, 0, 0, 0)
        painter.setPen(look.theme.colour("dim"))
        if rest.width() > 0:
            painter.drawText(rest, Qt.AlignmentFlag.AlignVCenter, metrics.elidedText(
                self._panel.described(name), Qt.TextElideMode.ElideRight, rest.width()))
        painter.restore()

    @staticmethod
    def eye(area: QRectF) -> QRectF:
        """Where the eye of a row is."""
        side = float(look_of().icon - 4)
        return QRectF(area.right() - side - 2, area.center().y() - side / 2, side, side)


class _List(QListWidget):
    """The list itself; its eyes and Delete are the panel's."""

    def __init__(self, panel: MapsPanel) -> None:
        super().__init__()
        self._panel = panel
        self.setUniformItemSizes(True)
        self.setMouseTracking(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName("Maps")
        self.setToolTip("The maps of the active groom. The eye shows one on the skin; Delete removes it.")

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(20 * look.text, min(max(self.count(), 2), 6) * (look.row - look.grid) + 4)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        item = self.itemAt(event.position().toPoint())
        if item is not None and _Rows.eye(QRectF(self.visualItemRect(item))).contains(event.position()):
            self._panel.toggle_overlay(item.text())
            return
        super().mousePressEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self._panel.delete()
        else:
            super().keyPressEvent(event)


class MapsPanel(QWidget):
    """List, buttons, what drives density and length, and the UV view."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk = desk
        self._seen: tuple[object, ...] = ()
        self._filling = False
        self.list = _List(self)
        self.list.setItemDelegate(_Rows(self))
        self._before: tuple[str | None, bool] = (None, True)  # map and hair of the view before painting
        self._painting: str | None = None  # the map shown for the paint tool
        self.paint_button = QPushButton("Paint")
        self.paint_button.setToolTip("Takes the brush that paints the chosen map on the skin; without any map a first "
                                     "one for the density. Hair steps aside meanwhile.")
        self.paint_button.clicked.connect(self.paint)
        self.new_button = QPushButton("New")
        self.new_button.setToolTip("Makes a map that is 1 everywhere, one number per vertex, ready to be painted on.")
        self.new_button.clicked.connect(self.new)
        self.load_button = QPushButton("Load…")
        self.load_button.setToolTip("Reads a PNG, JPEG or TIFF as a map over the UVs, in place of one of its name.")
        self.load_button.clicked.connect(self.ask)
        self.delete_button = QPushButton("Delete")
        self.delete_button.setToolTip("Takes the chosen map out of the groom; undo brings it back.")
        self.delete_button.clicked.connect(self.delete)
        self.roles = {role: Combo() for role in ROLES}
        self.view = UvView(desk)
        buttons = QHBoxLayout()
        buttons.setSpacing(4)
        for button in (self.paint_button, self.new_button, self.load_button, self.delete_button):
            buttons.addWidget(button, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addWidget(self.list)
        column.addLayout(buttons)
        for role, box in self.roles.items():
            box.setToolTip(COAT_FIELDS[role].tooltip)
            box.activated.connect(lambda place, role=role: self._assign(role, place))
            column.addWidget(Row(COAT_FIELDS[role].label, box))
        column.addWidget(self.view, 1)
        self.setAcceptDrops(True)
        self.list.currentTextChanged.connect(self._chosen)
        desk.changed.connect(self._changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.stroke_ended.connect(self.refresh)
        desk.session_replaced.connect(self.refresh)
        self.refresh()

    @property
    def overlay(self) -> str | None:
        """The map shown on the skin, or None."""
        return self._desk.workspace.view.map

    @property
    def chosen(self) -> str | None:
        """The name of the map the list is at."""
        item = self.list.currentItem()
        return None if item is None else item.text()

    def described(self, name: str) -> str:
        """What a map is and drives, in a few words."""
        groom = self._desk.groom
        item = None if groom is None else groom.map(name)
        if groom is None or item is None:
            return ""
        kind = "per vertex" if item.image is None else f"{item.image.shape[1]} × {item.image.shape[0]}"
        drives = [role.removesuffix("_map") for role in ROLES if getattr(groom.coat, role) == name]
        return " · ".join([kind, *drives])

    def refresh(self) -> None:
        """Show the maps as they are; nothing while a stroke goes on."""
        if self._desk.session.stroking:
            return
        groom = self._desk.groom
        seen = (None, None, None) if groom is None else (groom.id, groom.maps, groom.coat)
        if len(seen) == len(self._seen) and all(a is b or a == b for a, b in zip(seen, self._seen, strict=True)):
            return
        self._seen = seen
        names = [] if groom is None else [item.name for item in groom.maps]
        before = self.chosen
        self._filling = True
        try:
            if names != [self.list.item(row).text() for row in range(self.list.count())]:
                self.list.clear()
                self.list.addItems(names)
                if names:
                    self.list.setCurrentRow(names.index(before) if before in names else 0)
                self.list.updateGeometry()
            for role, box in self.roles.items():
                box.clear()
                box.addItems([NO_MAP[role], *names])
                driver = None if groom is None else getattr(groom.coat, role)
                box.setCurrentIndex(0 if driver is None else names.index(driver) + 1)
                box.setEnabled(groom is not None)
        finally:
            self._filling = False
        for button in (self.load_button, self.new_button, self.paint_button):
            button.setEnabled(groom is not None)
        self.delete_button.setEnabled(bool(names))
        self.view.show_map(self.chosen)
        self.list.viewport().update()

    def ask(self) -> None:
        """Let the artist choose a picture."""
        choose_file(self, "Load a map", [filter_of("Pictures", PICTURE_SUFFIXES)], self.load)

    def load(self, path: Path) -> None:
        """Read a picture as a map of the active groom, beside the window."""
        groom, desk = self._desk.groom, self._desk
        if groom is None:
            return
        number = groom.id

        def put(item: Map) -> None:
            if desk.edit("Load map", set_map, number, item):
                self._choose(item.name)

        desk.jobs.start(f"Read {path.name}", lambda progress, cancelled: map_from_image(path), put, owner=self)

    def new(self) -> None:
        """Make a flat map: the first for the density, others for whatever they are given to."""
        groom = self._desk.groom
        if groom is not None and self._desk.edit(
                "New map", add_flat_map, groom.id, "map" if groom.map(DENSITY) else DENSITY):
            self._choose(find_groom(self._desk.document, groom.id).maps[-1].name)

    def paint(self) -> None:
        """Take the brush for the chosen map; an image is copied to a map per vertex first."""
        groom, name, desk = self._desk.groom, self.chosen, self._desk
        if groom is None:
            return
        item = None if name is None else groom.map(name)
        if name is not None and item is not None and item.image is not None:
            copy = f"{name} painted"
            if groom.map(copy) is None and not desk.edit("Paintable map", paintable_copy, groom.id, name, copy):
                return
            name = copy
            self._choose(name)
        desk.choose(PAINT, map=name)

    def delete(self) -> None:
        """Take the chosen map out of the groom."""
        groom, name = self._desk.groom, self.chosen
        if groom is None or name is None:
            return
        if self._desk.edit("Delete map", remove_map, groom.id, name) and self.overlay == name:
            self.toggle_overlay(name)

    def toggle_overlay(self, name: str) -> None:
        """Show a map on the skin in the view, or no longer."""
        view = self._desk.workspace.view
        self._desk.set_workspace(view=view.replace(map=None if view.map == name else name))

    def _choose(self, name: str) -> None:
        for item in self.list.findItems(name, Qt.MatchFlag.MatchExactly):
            self.list.setCurrentItem(item)

    def _chosen(self, name: str) -> None:
        if self._filling:
            return
        self.view.show_map(name or None)
        item = None if self._desk.groom is None else self._desk.groom.map(name)
        if item is not None and item.values is not None and self._desk.workspace.tool == PAINT:
            self._desk.choose(PAINT, map=name)

    def _follow_tool(self) -> None:
        """Show the map that is painted, and no hair over it, while its brush is in the hand."""
        groom, workspace = self._desk.groom, self._desk.workspace
        view, painting = workspace.view, self._painting
        wanted = None
        if workspace.tool == PAINT and groom is not None:
            wanted = painted_name(groom, workspace.params.get(PAINT, {}).get("map"))
        if wanted == painting:
            return
        self._painting = wanted
        if wanted is not None:
            if painting is None:
                self._before = view.map, view.hair
                view = view.replace(hair=False)
            view = view.replace(map=wanted)
        else:
            seen, hair = self._before
            view = view.replace(map=seen if view.map == painting else view.map, hair=hair or view.hair)
        self._desk.set_workspace(view=view)

    def _assign(self, role: str, place: int) -> None:
        groom = self._desk.groom
        if groom is not None and not self._filling:
            name = groom.maps[place - 1].name if place else None
            if getattr(groom.coat, role) != name:
                self._desk.edit(COAT_FIELDS[role].label, set_coat, groom.id, **{role: name})

    def _changed(self, old: Document, new: Document) -> None:
        if old.grooms is not new.grooms:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.groom != new.groom:
            self.refresh()
        if old.view.map != new.view.map:
            self.list.viewport().update()
        if (old.tool, old.groom) != (new.tool, new.groom) or old.params.get(PAINT) is not new.params.get(PAINT):
            self._follow_tool()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if self._pictures(event):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        event.acceptProposedAction()
        for path in self._pictures(event):
            self.load(path)

    @staticmethod
    def _pictures(event: QDropEvent) -> list[Path]:
        paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
        return [path for path in paths if path.suffix.lower() in PICTURE_SUFFIXES]
