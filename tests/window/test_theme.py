"""Colours that can be read, icons that are sharp, measures on the grid."""

import itertools
import re
from pathlib import Path

import msgspec
import numpy as np
import pytest
from PySide6.QtCore import QSize
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from app.window.fields.combo import Combo
from app.window.icons import icon, icon_names, icon_pixmap
from app.window.theme import THEMES, Look, Theme, apply, load_theme, look_of

ROOT = Path(__file__).resolve().parents[2]
WORDS = ("text", "dim", "accent", "trouble_text")
GROUNDS = ("ground", "panel", "field")
ALSO = (("text", "hover"), ("text", "fill"), ("text", "fill_hover"), ("accent", "accent_ground"))


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.1."""
    parts = [int(colour[i:i + 2], 16) / 255.0 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_the_formula_gives_the_known_ratios() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("name", THEMES)
def test_words_can_be_read_on_every_ground(name: str) -> None:
    theme = load_theme(name)
    pairs = [*itertools.product(WORDS, GROUNDS), *ALSO]
    ratios = {pair: contrast(getattr(theme, pair[0]), getattr(theme, pair[1])) for pair in pairs}
    assert {pair: round(ratio, 2) for pair, ratio in ratios.items() if ratio < 4.5} == {}


@pytest.mark.parametrize("size", range(10, 21))
def test_measures_lie_on_the_grid_and_grow_with_the_text(size: int) -> None:
    look = Look(theme=load_theme("dark"), text=size)
    measures = (look.grid, look.gap, look.row, look.icon, look.shelf, look.label)
    assert all(m % 4 == 0 for m in measures)
    assert look.row >= size + 8
    assert look.icon >= 16
    larger = Look(theme=look.theme, text=size + 1)
    assert all(b >= a for a, b in zip(measures, (4, 8, larger.row, larger.icon, larger.shelf, larger.label)))


def test_a_theme_with_a_word_for_a_colour_is_refused_by_name() -> None:
    plain = msgspec.structs.asdict(load_theme("dark"))
    with pytest.raises(msgspec.ValidationError, match=r"Theme\.accent"):
        msgspec.convert({**plain, "accent": "orange"}, Theme)


@pytest.mark.parametrize("name", THEMES)
def test_applying_reaches_the_palette_the_font_and_every_asking_widget(qapp: QApplication, name: str) -> None:
    look = apply(qapp, load_theme(name), 15)
    assert look_of() is look
    assert qapp.font().pixelSize() == 15
    assert qapp.palette().window().color() == QColor(look.theme.panel)
    assert apply(qapp, load_theme("dark"), 99).text == 20


def test_icons_use_one_hand() -> None:
    assert len(icon_names()) > 60
    for name in icon_names():
        source = (ROOT / "resources" / "icons" / f"{name}.svg").read_text()
        assert 'viewBox="0 0 24 24"' in source
        assert 'stroke="currentColor" stroke-width="1.8"' in source
        assert 'stroke-linecap="round"' in source
        assert not re.search(r"#[0-9a-fA-F]{3,6}|<image|href|<text", source), name


@pytest.mark.parametrize("ratio", [1.0, 1.5, 2.0])
def test_icons_are_drawn_at_the_ratio_of_the_screen(qapp: QApplication, ratio: float) -> None:
    pixmap = icon_pixmap("comb", 20, QColor("#ff0000"), ratio)
    assert pixmap.width() == round(20 * ratio)
    assert pixmap.deviceIndependentSize().width() == pytest.approx(20.0)
    inked = _pixels(pixmap.toImage())
    assert inked[..., 3].max() == 255
    assert inked[inked[..., 3] == 255][:, :3].tolist() == [[0, 0, 255]] * int((inked[..., 3] == 255).sum())
    side = look_of().icon
    shown = icon("comb").pixmap(QSize(side, side), ratio)
    assert (shown.width(), shown.devicePixelRatio()) == (round(side * ratio), pytest.approx(ratio))


def test_every_icon_leaves_ink_within_its_frame(qapp: QApplication) -> None:
    for name in icon_names():
        alpha = _pixels(icon_pixmap(name, 48, QColor("#ffffff")).toImage())[..., 3]
        assert (alpha > 128).sum() > 20, name
        frame = np.concatenate([alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]])
        assert frame.max() < 128, f"{name} touches its frame"


def test_every_icon_that_is_asked_for_exists() -> None:
    wanted: set[str] = set()
    for folder in ("app/window", "tools"):
        for file in (ROOT / folder).rglob("*.py"):
            source = file.read_text()
            wanted |= set(re.findall(r"\bicon(?:: ClassVar\[str\])? ?= ?\"([a-z][a-z0-9-]*)\"", source))
            wanted |= set(re.findall(r"\b(?:icon|IconButton)\(\"([a-z][a-z0-9-]*)\"", source))
    assert wanted - set(icon_names()) == set()


def test_an_unknown_icon_is_named(qapp: QApplication) -> None:
    with pytest.raises(KeyError, match="no icon named 'combb'"):
        icon_pixmap("combb", 20, QColor("#ffffff"))


def _pixels(image: QImage) -> np.ndarray:
    image = image.convertToFormat(QImage.Format.Format_ARGB32)
    return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4).copy()  # B, G, R, A


@pytest.mark.parametrize("name", ["light", "dark"])
def test_a_list_that_drops_down_has_no_bevel(qtbot: QtBot, name: str) -> None:
    app = QApplication.instance()
    assert isinstance(app, QApplication)
    theme = load_theme(name)
    try:
        apply(app, theme, 12)
        combo = Combo()
        qtbot.addWidget(combo)
        combo.addItem("")
        combo.resize(200, 24)
        image = combo.grab().toImage()
        limits = [QColor(getattr(theme, colour)).lightness() for colour in ("field", "line", "dim", "panel")]
        right = [image.pixelColor(x, y).lightness() for x in range(160, 199) for y in range(1, 23)]
        assert min(limits) - 8 <= min(right)
        assert max(right) <= max(limits) + 8
        assert len({image.pixel(x, 12) for x in range(175, 196)}) > 2  # the chevron
    finally:
        apply(app, load_theme("dark"), 12)
