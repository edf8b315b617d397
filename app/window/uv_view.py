"""The 2-D view of UVs: a map under the edges of the islands, the roots of guides as dots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from PySide6.QtCore import QByteArray, QDataStream, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QImage, QMouseEvent, QPainter, QPainterPath, QPaintEvent, QPen, QPixmap, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.uv_layout import FlatMap, UvLayout, flat_map, grey, uv_layout, value_at
from app.window.desk import Desk
from app.window.theme import look_of, text_font
from core.document import Document, MeshObject, find_mesh
from core.groom.groom import Groom, Map
from core.groom.guides import Guides
from core.mesh.mesh import Mesh
from viewport.kept import same

NO_GROOM = "There is no groom: choose one in the scene to see its maps."
NO_UVS = "This mesh has no UVs. Maps from images need them: unwrap the mesh and reload it. Maps per vertex work."
WAIT = "Laying the mesh flat…"
MOST_LINES = 4000  # edges inside islands drawn at once; nearer, fewer are seen
NEAREST, FARTHEST = 2000.0, 0.05  # times the size at which the unit square fits


class _Shown(NamedTuple):
    """What lies in the view, and what it was made from."""

    mesh: Mesh
    item: Map | None
    layout: UvLayout
    flat: FlatMap | None
    picture: QImage | None


class UvView(QWidget):
    """Pans by dragging, zooms by the wheel, a double click fits. The map is set by :meth:`show_map`."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk = desk
        self._name: str | None = None
        self._shown: _Shown | None = None
        self._wanted: tuple[Mesh, Map | None] | None = None
        self._middle, self._zoom = QPointF(0.5, 0.5), 1.0  # UV in the middle of the view; 1 fits the unit square
        self._held: QPointF | None = None
        self._hover: QPointF | None = None
        self._still: tuple[object, ...] = ()
        self._rooted: tuple[object, ...] = ()  # roots and which are selected, as the picture has them
        self._pixmap = QPixmap()
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("UV view")
        self.setToolTip("Drag to slide, wheel to zoom, double click to fit. Lines: edges of UV islands. "
                        "Dots: roots of guides.")
        desk.changed.connect(self._changed)
        desk.workspace_changed.connect(lambda old, new: self.refresh() if old.groom != new.groom else None)
        desk.stroke_ended.connect(self.refresh)
        desk.session_replaced.connect(self.refresh)
        self.refresh()

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(20 * look.text, 20 * look.text)

    @property
    def words(self) -> str:
        """What the view says in place of a picture, or ""."""
        groom = self._desk.groom
        if groom is None:
            return NO_GROOM
        if self._item(groom).mesh.uvs is None:
            return NO_UVS
        return WAIT if self._shown is None else ""

    @property
    def about(self) -> str:
        """Where the pointer is: u, v and the value of the map there."""
        if self._hover is None or self._shown is None or self.words:
            return ""
        u, v = self.uv_at(self._hover)
        words = f"u {u:.3f}   v {v:.3f}"
        value = None if self._shown.flat is None else value_at(self._shown.flat, u, v)
        return words if value is None else f"{words}   value {value:.3f}"

    def show_map(self, name: str | None) -> None:
        """Lay this map of the active groom under the edges."""
        if name != self._name:
            self._name = name
            self.refresh()

    def refresh(self) -> None:
        """Show the active groom as it is; what has to be calculated is, beside the window."""
        if self._desk.session.stroking:
            return
        groom = self._desk.groom
        mesh = None if groom is None else self._item(groom).mesh
        if groom is None or mesh is None or mesh.uvs is None:
            self._shown = self._wanted = None
        else:
            item = None if self._name is None else groom.map(self._name)
            have = self._shown
            if have is None or have.mesh is not mesh or have.item is not item:
                self._ask(mesh, item)
            else:
                self._wanted = None
        self.update()

    def uv_at(self, place: QPointF) -> tuple[float, float]:
        """The UV under a place of the widget."""
        side = self._side()
        return (self._middle.x() + (place.x() - self.width() / 2) / side,
                self._middle.y() - (place.y() - self.height() / 2) / side)

    def place_of(self, u: float, v: float) -> QPointF:
        """Where a UV is in the widget."""
        side = self._side()
        return QPointF(self.width() / 2 + (u - self._middle.x()) * side,
                       self.height() / 2 - (v - self._middle.y()) * side)

    def fit(self) -> None:
        """Show the whole unit square."""
        self._middle, self._zoom = QPointF(0.5, 0.5), 1.0
        self.update()

    # -- what is shown ---------------------------------------------------------------------------------------

    def _item(self, groom: Groom) -> MeshObject:
        return find_mesh(self._desk.document, groom.mesh_id)

    def _ask(self, mesh: Mesh, item: Map | None) -> None:
        if self._wanted is not None and self._wanted[0] is mesh and self._wanted[1] is item:
            return
        self._wanted = mesh, item
        have = self._shown
        kept = have.layout if have is not None and have.mesh is mesh else None
        theme = look_of().theme.colour("field")
        ground = theme.red(), theme.green(), theme.blue()

        def work(progress: object, cancelled: object) -> tuple[UvLayout, FlatMap | None, np.ndarray | None]:
            flat = None if item is None else flat_map(item, mesh)
            return kept or uv_layout(mesh), flat, None if flat is None else grey(flat, ground)

        def done(result: tuple[UvLayout, FlatMap | None, np.ndarray | None]) -> None:
            if self._wanted is None or self._wanted[0] is not mesh or self._wanted[1] is not item:
                return  # something else is wanted by now
            layout, flat, pixels = result
            picture = None
            if pixels is not None:
                height, width = pixels.shape[:2]
                data = pixels.tobytes()  # must live until it is copied
                picture = QImage(data, width, height, 3 * width, QImage.Format.Format_RGB888).copy()
            self._shown, self._wanted = _Shown(mesh, item, layout, flat, picture), None
            self.update()

        self._desk.jobs.start("Lay the mesh flat", work, done, owner=self)

    def _changed(self, old: Document, new: Document) -> None:
        if self._desk.session.stroking:
            return
        if old.meshes is not new.meshes or old.grooms is not new.grooms:
            self.refresh()

    def _side(self) -> float:
        """Pixels of the widget along the unit square."""
        return max(16.0, 0.92 * min(self.width(), self.height())) * self._zoom

    # -- the hand --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() in (Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton):
            self._held = event.position()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._held = None

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._hover = event.position()
        if self._held is not None:
            moved, side = event.position() - self._held, self._side()
            self._middle += QPointF(-moved.x() / side, moved.y() / side)
            self._held = event.position()
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.fit()

    def leaveEvent(self, event: object) -> None:
        self._hover = None
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        place = event.position()
        before = self.uv_at(place)
        self._zoom = min(max(self._zoom * 1.0015 ** event.angleDelta().y(), FARTHEST), NEAREST)
        after = self.uv_at(place)
        self._middle += QPointF(before[0] - after[0], before[1] - after[1])  # what is under the pointer stays there
        event.accept()
        self.update()

    # -- the picture -----------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        area = QRectF(self.rect())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(look.theme.colour("line"))
        painter.setBrush(look.theme.colour("field"))
        painter.drawRoundedRect(area.adjusted(0.5, 0.5, -0.5, -0.5), 5.0, 5.0)
        painter.setFont(text_font(look))
        words = self.words
        if words:
            painter.setPen(look.theme.colour("dim"))
            painter.drawText(area.adjusted(12, 12, -12, -12),
                             Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, words)
            return
        painter.setClipRect(area.adjusted(1, 1, -1, -1))
        self._paint_still(painter)
        about = self.about
        if about:
            box = QRectF(0.0, self.height() - look.row, self.width(), look.row)
            painter.fillRect(box, look.theme.colour("field", 0.85))
            painter.setPen(look.theme.colour("text"))
            painter.drawText(box.adjusted(8, 0, -8, 0), Qt.AlignmentFlag.AlignVCenter, about)

    def _paint_still(self, painter: QPainter) -> None:
        """Map, edges and roots, from a picture of them while nothing of it has changed."""
        look, ratio, guides = look_of(), self.devicePixelRatioF(), self._guides()
        key = (id(self._shown), self.size(), ratio, self._middle.toTuple(), self._zoom, id(look))
        rooted = () if guides is None else (guides.roots, guides.selected)
        if key != self._still or not same(rooted, self._rooted):
            self._pixmap = QPixmap(self.size() * ratio)
            self._pixmap.setDevicePixelRatio(ratio)
            self._pixmap.fill(Qt.GlobalColor.transparent)
            layer = QPainter(self._pixmap)
            self._draw_still(layer)
            self._draw_roots(layer, guides)
            layer.end()
            self._still, self._rooted = key, rooted
        painter.drawPixmap(0, 0, self._pixmap)

    def _draw_still(self, painter: QPainter) -> None:
        look, shown = look_of(), self._shown
        assert shown is not None
        corner, side = self.place_of(0.0, 1.0), self._side()
        square = QRectF(corner.x(), corner.y(), side, side)
        if shown.picture is not None:
            large = shown.picture.width() < side * self.devicePixelRatioF()
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, not large)
            painter.drawImage(square, shown.picture)
        painter.setPen(look.theme.colour("line"))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(square)
        inner = self._seen(shown.layout.inner)
        if len(inner) <= MOST_LINES:  # more would be a grey veil, and slow
            painter.setPen(QPen(look.theme.colour("dim", 0.35), 0.0))
            painter.drawPath(_lines(inner))
        borders = self._seen(shown.layout.borders)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, len(borders) <= MOST_LINES)
        painter.setPen(QPen(look.theme.colour("text", 0.8), 1.0))
        painter.drawPath(_lines(borders))

    def _seen(self, edges: np.ndarray) -> np.ndarray:
        """Edges (n, 2, 2) in pixels, those within the view."""
        side = self._side()
        places = np.empty((len(edges), 2, 2))
        places[:, :, 0] = self.width() / 2 + (edges[:, 0::2] - self._middle.x()) * side
        places[:, :, 1] = self.height() / 2 - (edges[:, 1::2] - self._middle.y()) * side
        low, high = places.min(axis=1), places.max(axis=1)
        seen = (high[:, 0] >= 0) & (low[:, 0] <= self.width()) & (high[:, 1] >= 0) & (low[:, 1] <= self.height())
        return places[seen]

    def _guides(self) -> Guides | None:
        """Those of the active groom."""
        groom = self._desk.groom
        return None if groom is None else groom.guides

    def _draw_roots(self, painter: QPainter, guides: Guides | None) -> None:
        look = look_of()
        if guides is None or not len(guides):
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        uvs, side = guides.roots.uvs, self._side()
        x = self.width() / 2 + (uvs[:, 0] - self._middle.x()) * side
        y = self.height() / 2 - (uvs[:, 1] - self._middle.y()) * side
        seen = (x >= 0) & (x <= self.width()) & (y >= 0) & (y <= self.height())
        picked = guides.selected
        for rows, name, width in ((seen & ~picked, "accent", 2.5), (seen & picked, "text", 4.0)):
            pen = QPen(look.theme.colour(name, 0.9), width)
            pen.setCapStyle(Qt.PenCapStyle.RoundCap)
            painter.setPen(pen)
            painter.drawPoints([QPointF(a, b) for a, b in zip(x[rows].tolist(), y[rows].tolist(), strict=True)])


def _lines(places: np.ndarray) -> QPainterPath:
    """Lines (n, 2, 2) as one path, read from the bytes Qt writes of one: points made by Python are slow."""
    elements = np.empty(2 * len(places), [("kind", ">i4"), ("place", ">f8", 2)])
    elements["kind"] = np.tile([0, 1], len(places))  # move to, line to
    elements["place"] = places.reshape(-1, 2)
    count, closing = np.array(len(elements), ">i4").tobytes(), bytes(8)  # start of the last part, fill rule
    path = QPainterPath()
    if len(elements):
        QDataStream(QByteArray(count + elements.tobytes() + closing)) >> path
    return path
