"""Whether a window can be seen from here."""

from __future__ import annotations

import os
import sys

_NAMES = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")


def has_display() -> bool:
    """True where a display is named; on desktops other than Linux there always is one."""
    return not sys.platform.startswith("linux") or any(os.environ.get(name) for name in _NAMES)
