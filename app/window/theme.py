"""Colours and measures of the window: one record from a file, given to the whole program at once.

Widgets of our own painting ask :func:`look_of` while they paint, so that a change of theme or text size needs nothing
but a repaint. No font comes with the program: it asks for families that read well and takes what there is.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import resources
from string import Template

import msgspec
from PySide6.QtCore import QCoreApplication
from PySide6.QtGui import QColor, QFont, QPalette
from PySide6.QtWidgets import QApplication, QStyleFactory

from core.record import Record

FAMILIES = ("Inter", "Noto Sans", "Segoe UI", "Helvetica Neue", "DejaVu Sans")
MONOSPACE = ("JetBrains Mono", "Noto Sans Mono", "Consolas", "Menlo", "DejaVu Sans Mono")
SMALLEST_TEXT, LARGEST_TEXT = 10, 20  # pixels
THEMES = ("dark", "light")

_PROPERTY = "filoplume_look"
_COLOUR = re.compile(r"#[0-9a-f]{6}")


class Theme(Record):
    """Colours as "#rrggbb".

    ground : behind panels, of the menu's and timeline's room. panel, field : of panels and what is typed into.
    line : hairlines and frames. hover : under the pointer. text, dim : of words; `dim` of what is secondary.
    accent, accent_ground : of what is active, and behind it. fill, fill_hover : the filled part of bars.
    cached : frames that are cached. trouble, trouble_text : what is wrong, and words about it.
    """

    name: str
    ground: str
    panel: str
    field: str
    line: str
    hover: str
    text: str
    dim: str
    accent: str
    accent_ground: str
    fill: str
    fill_hover: str
    cached: str
    trouble: str
    trouble_text: str

    def __post_init__(self) -> None:
        for name in self.__struct_fields__[1:]:
            if not _COLOUR.fullmatch(getattr(self, name)):
                raise ValueError(f"Theme.{name} must be a colour like #26282c, not {getattr(self, name)!r}")

    def colour(self, name: str, opacity: float = 1.0) -> QColor:
        """One of the colours by the name of its field."""
        colour = QColor(getattr(self, name))
        colour.setAlphaF(opacity)
        return colour


class Look(Record):
    """A theme at a text size; all measures are pixels on a grid of four.

    text : height of the text. grid : the smallest distance. gap : between things. row : height of a bar or button.
    icon : side of an icon. shelf : side of a button of the tool shelf. label : width of the column of labels.
    """

    theme: Theme
    text: int = 12

    @property
    def grid(self) -> int:
        return 4

    @property
    def gap(self) -> int:
        return 8

    @property
    def row(self) -> int:
        return _on_grid(self.text * 1.85)

    @property
    def icon(self) -> int:
        return _on_grid(self.text * 1.6)

    @property
    def shelf(self) -> int:
        return _on_grid(self.text * 3.0)

    @property
    def label(self) -> int:
        return _on_grid(self.text * 9.5)

    @property
    def small(self) -> int:
        """Height of the text of headings."""
        return max(9, round(self.text * 0.85))


@cache
def load_theme(name: str) -> Theme:
    """The theme of that name from resources/themes, read once."""
    return msgspec.json.decode((resources.files("resources") / "themes" / f"{name}.json").read_bytes(), type=Theme)


def apply(app: QApplication, theme: Theme, text_size: int = 12) -> Look:
    """Give the whole program a theme and a size of text (held within 10 .. 20 pixels); any number of times."""
    look = Look(theme=theme, text=min(max(text_size, SMALLEST_TEXT), LARGEST_TEXT))
    # Another sheet in place of one makes Qt polish a widget once for each of its ancestors; from none to one, once.
    app.setStyleSheet("")
    if app.style().objectName() != "fusion":
        app.setStyle(QStyleFactory.create("Fusion"))
    app.setProperty(_PROPERTY, look)
    app.setFont(text_font(look))
    app.setPalette(_palette(theme))
    app.setStyleSheet(_stylesheet(look))
    return look


def look_of(app: QCoreApplication | None = None) -> Look:
    """The look :func:`apply` has given the program; the dark one before that."""
    app = app or QApplication.instance()
    look = None if app is None else app.property(_PROPERTY)
    return look if isinstance(look, Look) else Look(theme=load_theme("dark"))


def text_font(look: Look, size: int | None = None, spacing: float = 0.0) -> QFont:
    """The font of the window in pixels; `spacing` between letters in pixels."""
    font = QFont(list(FAMILIES))
    font.setPixelSize(look.text if size is None else size)
    if spacing:
        font.setLetterSpacing(QFont.SpacingType.AbsoluteSpacing, spacing)
    return font


def code_font(look: Look) -> QFont:
    """The font of expressions and the console."""
    font = QFont(list(MONOSPACE))
    font.setStyleHint(QFont.StyleHint.Monospace)
    font.setPixelSize(look.text)
    return font


def _on_grid(pixels: float) -> int:
    return 4 * round(pixels / 4.0)


def _palette(theme: Theme) -> QPalette:
    role, palette = QPalette.ColorRole, QPalette()
    for name, roles in {
        "panel": (role.Window, role.AlternateBase),
        "hover": (role.Button, role.Midlight),
        "field": (role.Base, role.ToolTipBase),
        "line": (role.Mid, role.Light),
        "ground": (role.Dark, role.Shadow),
        "text": (role.WindowText, role.Text, role.ButtonText, role.ToolTipText, role.HighlightedText),
        "dim": (role.PlaceholderText,),
        "fill": (role.Highlight,),
        "accent": (role.Link, role.LinkVisited, role.Accent),
        "trouble_text": (role.BrightText,),
    }.items():
        for each in roles:
            palette.setColor(each, theme.colour(name))
    for each in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, each, theme.colour("dim"))
    return palette


def _stylesheet(look: Look) -> str:
    colours = {name: getattr(look.theme, name) for name in look.theme.__struct_fields__}
    source = (resources.files("resources") / "themes" / "window.qss").read_text("utf-8")
    return Template(source).substitute(
        colours, grid=look.grid, gap=look.gap, wide=2 * look.gap, corner=5, thin=3, inner=look.row - 2,
        list=look.row - 2,
    )
