"""The editor of one keyed curve, below the bar of its value."""

from __future__ import annotations

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from app.window.fields.number_text import Scale
from app.window.timeline.curve_view import PLAIN, CurveView, Shown
from core.curve import Curve, Tangent
from core.curve_edit import with_tangents, without_keys

# what menus and buttons call the tangents of a key
TANGENTS: dict[Tangent, str] = {
    "smooth": "Auto tangents", "linear": "Linear tangents", "step": "Constant tangents",
    "aligned": "Aligned handles", "free": "Free handles"}


class CurveEditor(CurveView):
    """A view of one curve that reads keys: Delete takes the selected ones away, F or Home shows what is selected or
    all; the right button turns tangents.

    edited_one : (Curve, final). Esc gives the very curve there was before.
    """

    edited_one = Signal(object, bool)

    def __init__(
        self, curve: Curve, scale: Scale = PLAIN, frame: float = 0.0, parent: QWidget | None = None,
    ) -> None:
        super().__init__(scale, parent)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Curve")
        self.setToolTip("Drag keys and handles; double-click sets a key, Delete takes it away, "
                        "the right button turns tangents, F shows all of it.")
        self.edited.connect(lambda step, curves, final: self.edited_one.emit(curves[""], final))
        self.set_curve(curve)
        self.set_frame(frame)
        self.show_keys()

    @property
    def selected(self) -> frozenset[int]:
        """Places of the selected keys."""
        return self.picked.get("", frozenset())

    def curve(self) -> Curve:
        """The curve shown."""
        return self.curves()[""]

    def set_curve(self, curve: Curve) -> None:
        """Show a curve from outside; while a hand drags the hand's stays."""
        self.set_shown({"": Shown(curve)})

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()  # the panel scrolls

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and event.key() in (
            Qt.Key.Key_Delete, Qt.Key.Key_Backspace, Qt.Key.Key_F, Qt.Key.Key_Home,
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = event.key()
        if key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self.delete_selected()
        elif key in (Qt.Key.Key_F, Qt.Key.Key_Home):
            self.show_keys(self.picked if key == Qt.Key.Key_F else None)
        else:
            super().keyPressEvent(event)

    def delete_selected(self) -> None:
        """Take the selected keys away; one always stays."""
        left = without_keys(self.curve(), self.selected)
        if self.selected and left is not None:
            self.picked = {}
            self._commit(left)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        places = self.selected or frozenset(range(len(self.curve().keys)))
        for kind, label in TANGENTS.items():
            menu.addAction(label).triggered.connect(
                lambda _=False, wanted=kind: self._commit(with_tangents(self.curve(), places, wanted)))
        menu.addSeparator()
        delete = menu.addAction("Delete keys")
        delete.setEnabled(0 < len(self.selected) < len(self.curve().keys))
        delete.triggered.connect(self.delete_selected)
        menu.addAction("Show all").triggered.connect(lambda: self.show_keys())
        menu.popup(event.globalPos())

    def _commit(self, curve: Curve) -> None:
        self.set_curve(curve)
        self.edited_one.emit(curve, True)
