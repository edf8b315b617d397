"""The timeline of a document: its range and rate, and which frames are keyed."""

from __future__ import annotations

from core.curve import Curve
from core.document import FRAMES, RATES, Document
from core.errors import UserError
from core.groom.groom import COAT_VALUES
from core.posed import moves


def with_range(document: Document, first: int, last: int) -> Document:
    """The document with another first and last frame; of two that are crossed the smaller one is the first.

    Raises
    ------
    UserError
        Frames no timeline can have.
    """
    first, last = sorted((first, last))
    if not FRAMES[0] <= first <= last <= FRAMES[1]:
        raise UserError(f"Frames go from {FRAMES[0]:,} to {FRAMES[1]:,}; give others.")
    if (first, last) == (document.first_frame, document.last_frame):
        return document
    result: Document = document.replace(first_frame=first, last_frame=last)
    return result


def with_rate(document: Document, fps: float) -> Document:
    """The document played at so many frames per second; UserError for a rate nothing plays at."""
    if not RATES[0] <= fps <= RATES[1]:
        raise UserError(f"A rate goes from {RATES[0]:g} to {RATES[1]:,.0f} frames per second; give another.")
    result: Document = document if fps == document.fps else document.replace(fps=float(fps))
    return result


def keyed_frames(document: Document) -> tuple[float, ...]:
    """Frames at which a number of any coat has a key, ascending, each once."""
    frames = {
        key.frame
        for groom in document.grooms for name in COAT_VALUES
        if isinstance(base := getattr(groom.coat, name).base, Curve) for key in base.keys
    }
    return tuple(sorted(frames))


def clip_range(document: Document) -> tuple[float, float] | None:
    """First and last frame at which the clip of any mesh has a sample; None when nothing moves."""
    clips = [item.rig.clip for item in document.meshes if moves(item) and item.rig is not None]
    found = [(clip.start, clip.end) for clip in clips if clip is not None]
    return (min(a for a, _ in found), max(b for _, b in found)) if found else None
