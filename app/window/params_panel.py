"""Panels that build themselves from the described fields of a record."""

from __future__ import annotations

from collections.abc import Collection
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

import msgspec
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.window.fields.bars_together import BarsTogether
from app.window.fields.choice_bar import ChoiceBar, SwitchBar, TextField
from app.window.fields.color_field import ColorField
from app.window.fields.field_widget import FieldWidget
from app.window.fields.number_bar import NumberBar
from app.window.fields.value_field import ValueField
from app.window.fields.vector_field import VectorField
from app.window.sections import Row
from core.field import Field, fields_of
from core.record import Record
from core.value import Value


class Setting(NamedTuple):
    """What fields need to know beside their value.

    unit : of lengths. frame : shown. names, maps : an expression may read; `maps` a value may be multiplied by.
    """

    unit: str = "m"
    frame: float = 0.0
    names: tuple[str, ...] = ("frame",)
    maps: tuple[str, ...] = ()


class RecordForm(QWidget):
    """Rows of labels and fields for every described field of a record.

    changed : (record, final). Previews while the hand moves, then one that is final; when an edit is taken back, or
        ends where it began, the final record is the very one that was set, so that ``is`` tells.
    """

    changed = Signal(object, bool)

    def __init__(self, record: Record, setting: Setting = Setting(), parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._record, self._before, self._setting = record, record, setting
        self._changes: dict[str, Any] = {}  # of the edit that goes on, which may be of several fields
        self.fields: dict[str, FieldWidget | ValueField | VectorField] = {}
        self.rows: dict[str, Row] = {}
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        together = BarsTogether(self)
        together.ended.connect(self._finish)
        kind = type(record)
        defaults = {f.name: f.default for f in msgspec.structs.fields(kind)}
        hints = get_type_hints(kind, include_extras=True)
        for name, known in fields_of(kind).items():
            default = None if defaults[name] is msgspec.NODEFAULT else defaults[name]
            widget = make_field(known, hints[name], getattr(record, name), default, setting)
            widget.edited.connect(lambda value, final, name=name: self._edited(name, value, final))
            widget.setObjectName(name)
            row = Row(known.label, widget)
            row.label.setToolTip(f"<p style='white-space:normal'>{known.tooltip}</p>")
            column.addWidget(row)
            self.fields[name], self.rows[name] = widget, row
            bar = widget.bar if isinstance(widget, ValueField) else widget
            if isinstance(bar, NumberBar):
                together.add(bar, row.label)

    @property
    def editing(self) -> bool:
        """True while a hand is at one of the fields."""
        return any(widget.editing for widget in self.fields.values())

    def record(self) -> Any:
        """The record shown."""
        return self._record

    def set_record(self, record: Record) -> None:
        """Show a record of the same type from outside; the field a hand is editing keeps the hand's value."""
        old = self._record
        if record is old:
            return
        self._record = record
        if not self.editing:
            self._before = record
        for name, widget in self.fields.items():
            value = getattr(record, name)
            if value is not getattr(old, name) or value is not widget.value():
                widget.set_value(value)

    def set_setting(self, setting: Setting) -> None:
        """Tell the fields of another frame, unit or other maps."""
        old, self._setting = self._setting, setting
        for widget in self.fields.values():
            if isinstance(widget, ValueField):
                widget.set_frame(setting.frame)
                widget.set_maps(setting.maps)
            elif isinstance(widget, MapBar) and setting.maps != old.maps:
                widget.set_maps(setting.maps)
            if setting.unit != old.unit and isinstance(widget, NumberBar | ValueField | VectorField):
                widget.set_unit(setting.unit)

    def _edited(self, name: str, value: Any, final: bool) -> None:
        self._changes[name] = value
        changed = {n: made for n, made in self._changes.items() if not _same(made, getattr(self._before, n))}
        self._record = self._before.replace(**changed) if changed else self._before
        if final and not self.editing:
            self._finish()
        else:
            self.changed.emit(self._record, False)

    def _finish(self) -> None:
        """What was changed since the last time is final, of one field or of several."""
        if self._changes:
            self._before, self._changes = self._record, {}
            self.changed.emit(self._record, True)


def _same(one: Any, other: Any) -> bool:
    return one is other or (not isinstance(one, Record) and bool(one == other))


class MapBar(ChoiceBar):
    """The name of a map, or none."""

    def __init__(self, known: Field, value: str | None, default: str | None, maps: Collection[str]) -> None:
        super().__init__(known, value, default, (None, *maps), ("none", *maps))

    def set_maps(self, maps: Collection[str]) -> None:
        """Offer other maps."""
        self.set_choices((None, *maps), ("none", *maps))


def make_field(
    known: Field, hint: Any, value: Any, default: Any = None, setting: Setting = Setting(),
) -> FieldWidget | ValueField | VectorField:
    """The widget for a field of a record, by the type it is annotated with.

    A text that may be None is the name of a map.
    """
    kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    if kind is Value:
        return ValueField(known, value, default, setting.unit, setting.names, setting.maps, setting.frame)
    if kind is bool:
        return SwitchBar(known, value, default)
    if kind in (int, float):
        return NumberBar(known, value, default, setting.unit, whole=kind is int)
    if get_origin(kind) is Literal:
        return ChoiceBar(known, value, default, known.choices or get_args(kind))
    if get_origin(kind) in (Union, UnionType) and set(get_args(kind)) == {str, NoneType}:
        return MapBar(known, value, default, setting.maps)
    if kind is str:
        return ChoiceBar(known, value, default) if known.choices else TextField(known, value, default)
    if get_origin(kind) is tuple and get_args(kind) == (float, float, float):
        if known.soft is not None and known.soft[0] < 0.0:  # colours have nothing below 0
            return VectorField(known, value, default, setting.unit)
        return ColorField(known, value, default)
    raise TypeError(f"there is no field for {known.label} of type {kind}")
