"""The meshes of a document with their grooms as a tree for Qt. It holds the records and nothing of its own."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QAbstractItemModel, QMimeData, QModelIndex, QPersistentModelIndex, QSize, Qt

from app.window.desk import Desk
from app.window.theme import look_of
from core.document import Document, MeshObject
from core.groom.groom import Groom
from tools.document_edits import move_groom, move_mesh, rename_groom, rename_mesh

MIME = "application/x-filoplume-outliner"
ITEM = Qt.ItemDataRole.UserRole  # the record of a row
Index = QModelIndex | QPersistentModelIndex
Item = MeshObject | Groom


class SceneModel(QAbstractItemModel):
    """Follows the document by :meth:`follow`; renaming and dragging are steps of history."""

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk)
        self._desk = desk
        self._meshes: tuple[MeshObject, ...] = ()
        self._grooms: dict[int, list[Groom]] = {}
        self._grooms_of: tuple[Groom, ...] = ()
        self._rows: dict[int, int] = {}  # id of a mesh -> its row
        self._take(desk.document)

    def follow(self, document: Document) -> bool:
        """Show a document: rows whose records are others, or everything (True) when rows came, went or moved."""
        if document.meshes is self._meshes and document.grooms is self._grooms_of:
            return False
        old_meshes, old_grooms = self._meshes, self._grooms_of
        same = _shape(old_meshes, old_grooms) == _shape(document.meshes, document.grooms)
        if not same:
            self.beginResetModel()
            self._take(document)
            self.endResetModel()
            return True
        self._take(document)
        pairs = (*zip(old_meshes, document.meshes, strict=True), *zip(old_grooms, document.grooms, strict=True))
        for old, new in pairs:
            if old is not new:
                index = self.index_of(new)
                self.dataChanged.emit(index, index)
        return False

    def index_of(self, item: Item) -> QModelIndex:
        """The place of the mesh or groom of that id."""
        if isinstance(item, MeshObject):
            row = self._rows.get(item.id)
            return QModelIndex() if row is None else self.createIndex(row, 0, 0)
        for row, groom in enumerate(self._grooms.get(item.mesh_id, ())):
            if groom.id == item.id:
                return self.createIndex(row, 0, item.mesh_id + 1)
        return QModelIndex()

    def item(self, index: Index) -> Item | None:
        """The record of a row."""
        if not index.isValid():
            return None
        inside = index.internalId()
        if inside == 0:
            return self._meshes[index.row()]
        return self._grooms[inside - 1][index.row()]

    def grooms_on(self, mesh_id: int) -> list[Groom]:
        """The grooms of a mesh, in order."""
        return self._grooms.get(mesh_id, [])

    # -- what Qt asks ----------------------------------------------------------------------------------------

    def rowCount(self, parent: Index = QModelIndex()) -> int:
        if not parent.isValid():
            return len(self._meshes)
        return 0 if parent.internalId() else len(self.grooms_on(self._meshes[parent.row()].id))

    def columnCount(self, parent: Index = QModelIndex()) -> int:
        return 1

    def index(self, row: int, column: int, parent: Index = QModelIndex()) -> QModelIndex:
        if column != 0 or not 0 <= row < self.rowCount(parent):
            return QModelIndex()
        return self.createIndex(row, 0, self._meshes[parent.row()].id + 1 if parent.isValid() else 0)

    def parent(self, index: Index) -> QModelIndex:  # type: ignore[override] # QObject.parent() has the same name
        if not index.isValid() or index.internalId() == 0:
            return QModelIndex()
        return self.createIndex(self._rows[index.internalId() - 1], 0, 0)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        item = self.item(index)
        if item is None:
            return None
        if role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.EditRole):
            return item.name
        if role == ITEM:
            return item
        if role == Qt.ItemDataRole.SizeHintRole:
            return QSize(0, look_of().row - look_of().grid)
        if role == Qt.ItemDataRole.AccessibleDescriptionRole:
            return counted(item)
        return None

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        item = self.item(index)
        if item is None or role != Qt.ItemDataRole.EditRole or str(value) == item.name:
            return False
        return self._desk.edit("Rename", rename_mesh if isinstance(item, MeshObject) else rename_groom, item.id,
                               str(value))

    def flags(self, index: Index) -> Qt.ItemFlag:
        if not index.isValid():
            return Qt.ItemFlag.ItemIsDropEnabled
        return (Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEditable
                | Qt.ItemFlag.ItemIsDragEnabled | Qt.ItemFlag.ItemIsDropEnabled)

    # -- dragging --------------------------------------------------------------------------------------------

    def supportedDropActions(self) -> Qt.DropAction:
        return Qt.DropAction.MoveAction

    def mimeTypes(self) -> list[str]:
        return [MIME]

    def mimeData(self, indexes: Any) -> QMimeData:
        item, data = self.item(indexes[0]), QMimeData()
        if item is not None:
            data.setData(MIME, f"{type(item).__name__} {item.id}".encode())
        return data

    def canDropMimeData(self, data: QMimeData, action: Qt.DropAction, row: int, column: int, parent: Index) -> bool:
        return self._move(data, row, parent) is not None

    def dropMimeData(self, data: QMimeData, action: Qt.DropAction, row: int, column: int, parent: Index) -> bool:
        wanted = self._move(data, row, parent)
        if wanted is not None:
            item, place = wanted
            self._desk.edit("Reorder", move_mesh if isinstance(item, MeshObject) else move_groom, item.id, place)
        return False  # Qt must not take away the row it believes to have moved

    def _move(self, data: QMimeData, row: int, parent: Index) -> tuple[Item, int] | None:
        """What is dragged, and the place it would get in the document; None where it may not lie."""
        kind, _, number = bytes(data.data(MIME).data()).decode().partition(" ")
        if not number.isdigit():
            return None
        if kind == "MeshObject":
            item = next((m for m in self._meshes if m.id == int(number)), None)
            if item is None or (row >= 0 and parent.isValid()):
                return None
            target = row if row >= 0 else self._top_row(parent)
            return item, target - (row >= 0 and self._rows[item.id] < target)
        groom = next((g for g in self._grooms_of if g.id == int(number)), None)
        onto = self.item(parent)
        if groom is None or onto is None:
            return None
        siblings = self.grooms_on(groom.mesh_id)
        if isinstance(onto, Groom):  # on another groom: its place
            place = parent.row()
        else:  # between two, or on the mesh: the last
            place = len(siblings) if row < 0 else row - (siblings.index(groom) < row)
        if (onto.mesh_id if isinstance(onto, Groom) else onto.id) != groom.mesh_id:
            return None  # its hair is bound to its own mesh
        others = [g for g in siblings if g is not groom]
        rest = [g for g in self._grooms_of if g is not groom]
        if not others:
            return groom, self._grooms_of.index(groom)
        return groom, rest.index(others[place]) if place < len(others) else rest.index(others[-1]) + 1

    def _top_row(self, parent: Index) -> int:
        if not parent.isValid():
            return len(self._meshes)
        return parent.row() if parent.internalId() == 0 else self._rows[parent.internalId() - 1]

    def _take(self, document: Document) -> None:
        if document.meshes is not self._meshes:
            self._meshes = document.meshes
            self._rows = {item.id: row for row, item in enumerate(document.meshes)}
        if document.grooms is not self._grooms_of:
            self._grooms_of = document.grooms
            self._grooms = {}
            for groom in document.grooms:
                self._grooms.setdefault(groom.mesh_id, []).append(groom)


def counted(item: Item) -> str:
    """What is counted of a thing: "15,894 faces", "2,500 guides"."""
    number, word = (len(item.mesh.counts), "face") if isinstance(item, MeshObject) else (len(item.guides), "guide")
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def _shape(meshes: tuple[MeshObject, ...], grooms: tuple[Groom, ...]) -> tuple[list[int], list[tuple[int, int]]]:
    return [m.id for m in meshes], [(g.id, g.mesh_id) for g in grooms]
