"""What is asked of a solve, and what it answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.match.solve.bundle import Free
from core.match.solve.state import FOCAL, Array, Flags, Observations, Rows, State, start_lens
from core.match.solve.views import Views


class Options(NamedTuple):
    """focal : pixels, or None. free_focal : find it too. zoom : it changes from frame to frame.
    distortion : find the bend of the lens too. nodal : the camera only turns. lens : a model of core/match/lens.py.
    readout : share of a frame in which a rolling shutter reads all rows, from above. free_readout : find it too.
    given : (L,) a lens that was measured; its bend stays, its focal length is a beginning where `focal` is None."""

    focal: float | None = None
    free_focal: bool = False
    zoom: bool = False
    distortion: bool = False
    nodal: bool = False
    lens: str = "brown"
    readout: float = 0.0
    free_readout: bool = False
    given: Array | None = None

    def lens_at(self, focal: float, size: tuple[int, int]) -> Array:
        """The lens a solve begins with at a focal length in pixels."""
        if self.given is None:
            return start_lens(focal, *size, self.lens)
        lens = self.given.copy()
        lens[FOCAL] = np.log(focal)
        return lens


AS_GIVEN = Options()


class Solution(NamedTuple):
    """A solved path.

    state : F frames and P points; frames (F,) their numbers; tracks (P,) rows of the tracks given.
    known : (F,) frames that have a camera. held : (P,) tracks that have a point. used : (N,) observations counted in.
    kind : "free" or "nodal". noise : standard deviation of an axis the tracks have by themselves, whitened.
    sigma : standard deviation of the whitened residuals of an axis. keys : rows of the keyframes.
    free : what was found; the rest was given. said : words for the artist.
    pixel : (F,) pixels of its own picture that one of the solve is in each frame; 1 but for photographs and witnesses.
    views : who took which frame. The observations are as the first camera would have them.
    noise_told : whether the tracks told `noise`; too few seen together do not.
    """

    state: State
    frames: Rows
    known: Flags
    held: Flags
    used: Flags
    observations: Observations
    kind: str
    noise: float
    sigma: float
    keys: tuple[int, ...]
    size: tuple[int, int]
    free: Free
    said: tuple[str, ...]
    pixel: Array
    views: Views
    noise_told: bool = True
