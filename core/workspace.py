"""The workspace: where the artist left off. Saved beside the document, outside undo."""

from __future__ import annotations

from typing import Annotated, Any

from core.camera import Camera
from core.field import field
from core.gate import Gate
from core.record import Record, number, text

SHADINGS = ("shaded", "matcap", "wire", "lines")

PROXIES = ("full", "half", "quarter")

class Respect(Record):
    """What every tool heeds. Frozen guides are never edited, whatever stands here."""

    hairspray: Annotated[bool, field(
        "Hairspray", "Sprayed hair holds its shape under every tool; off edits it as if it were free.")] = True
    selection: Annotated[bool, field(
        "Selection", "While any guides are selected tools edit only those; off edits all of them.")] = True
    symmetry: Annotated[bool, field(
        "Symmetry X", "Every stroke is made on the other side of the animal too, across its own X = 0 plane.")] = False


class Reference(Record):
    """An image pinned to the view. Place and width are fractions of the view's width and height from its top left."""

    path: str
    x: Annotated[float, field(
        "From the left", "Where its left side is, as a part of the view's width.", "", (0, 1), (-10, 10))] = 0.02
    y: Annotated[float, field(
        "From the top", "Where its upper side is, as a part of the view's height.", "", (0, 1), (-10, 10))] = 0.02
    width: Annotated[float, field(
        "Width", "How wide it is, as a part of the view's width; its shape stays.", "", (0.02, 1), (0.001, 10))] = 0.25
    opacity: Annotated[float, field(
        "Opacity", "How much of the view it covers; less lets the animal shine through.", "", (0, 1), (0, 1))] = 1.0

    def __post_init__(self) -> None:
        text(self, "path", longest=4096)
        number(self, "x", "y", least=-10.0, most=10.0)
        number(self, "width", least=0.001, most=10.0)
        number(self, "opacity", least=0.0, most=1.0)


class ViewOptions(Record):
    """How the viewport shows the document.

    shading : of meshes, one of SHADINGS. map : name of the map shown as colours on the skin, or None.
    heat : what of the posed mesh is shown as colours, one of ``core.pose.heat.VIEWS``, or "" for none. compare : the
    methods of ``core.pose.compare`` shown side by side, none for the usual single view.
    isolated : ids of the only meshes shown (with their grooms), empty for all; ghosted : ids shown translucent.
    background : path of an image behind everything, or None.
    over_plate : opacity, 0 .. 1, of the scene over a plate whose camera is solved.
    gate : of a film camera, or None. safe_areas : whether it shows where action and titles are safe.
    """

    shading: str = "shaded"
    wire: bool = False
    hair: bool = True
    guides: bool = True
    grid: bool = True
    axes: bool = True
    hud: bool = True
    map: str | None = None
    heat: str = ""
    compare: tuple[str, ...] = ()
    isolated: tuple[int, ...] = ()
    ghosted: tuple[int, ...] = ()
    background: str | None = None
    references: tuple[Reference, ...] = ()
    gate: Gate | None = None
    gate_shown: bool = True
    safe_areas: bool = False
    over_plate: float = 1.0

    def __post_init__(self) -> None:
        number(self, "over_plate", least=0.0, most=1.0)
        if self.shading not in SHADINGS:
            raise ValueError(f"ViewOptions.shading must be one of {', '.join(SHADINGS)}, not {self.shading!r}")

    @property
    def edges(self) -> bool:
        """True when the edges of polygons are drawn."""
        return self.wire or self.shading in ("wire", "lines")


class PlateLook(Record):
    """How frames of plates are shown; what tracking sees of them is the plate's own.

    display : "Display / View" of the OpenColorIO configuration, or "" for its first.
    """

    proxy: Annotated[str, field(
        "Proxy", "Shows frames at full size, or at a half or a quarter, which is read sooner; tracking sees all of it.",
        choices=PROXIES)] = "full"
    exposure: Annotated[float, field(
        "Exposure", "Shows plates brighter or darker by so many stops; nothing that is tracked or written changes.", "",
        (-6.0, 6.0), (-20.0, 20.0), 0.5)] = 0.0
    gamma: Annotated[float, field(
        "Gamma", "Lifts what is dark on the screen above 1, to judge shadows; nothing that is tracked changes.", "",
        (0.3, 3.0), (0.05, 10.0), 0.1)] = 1.0
    speed: Annotated[float, field(
        "Speed", "How fast plates play; below 1 the frames in between are made by optical flow (Slow motion).", "",
        (0.1, 2.0), (0.05, 10.0), 0.05)] = 1.0
    display: str = ""

    def __post_init__(self) -> None:
        number(self, "speed", least=0.05, most=10.0)
        number(self, "exposure", least=-20.0, most=20.0)
        number(self, "gamma", least=0.05, most=10.0)
        if self.proxy not in PROXIES:
            raise ValueError(f"PlateLook.proxy must be one of {', '.join(PROXIES)}, not {self.proxy!r}")

    def seen(self) -> tuple[str, float, float, str]:
        """All of it that changes what a frame looks like."""
        return self.proxy, self.exposure, self.gamma, self.display

    def words(self) -> str:
        """What is not shown as it is, in a few words; "" for nothing."""
        told = [f"exposure {self.exposure:+.1f} stops"] if self.exposure else []
        told += [f"gamma {self.gamma:.2f}"] if self.gamma != 1.0 else []
        told += [f"{self.proxy} proxy"] if self.proxy != "full" else []
        told += [f"speed {self.speed:g}"] if self.speed != 1.0 else []
        return " · ".join(told)


class Workspace(Record):
    """Where the artist left off.

    frame : the current frame.
    cameras : the cameras of the views, first the one last used. bookmarks : cameras by name.
    panels : names of the visible panels.
    craft : name of the active craft.
    groom : id of the groom that tools edit; None for the first of the document.
    mesh : id of the mesh that is posed and sculpted; None for the first with a rig.
    tool : name of the active tool; params : parameters of the tools by name as plain JSON values, never changed in
        place.
    plate_look : how frames of plates are shown.
    """

    frame: float = 1001.0
    cameras: tuple[Camera, ...] = ()
    bookmarks: dict[str, Camera] = {}  # noqa: RUF012 (msgspec makes a new one each time)
    panels: tuple[str, ...] = ()
    craft: str = "groom"
    groom: int | None = None
    mesh: int | None = None
    tool: str = ""
    params: dict[str, Any] = {}  # noqa: RUF012 (msgspec makes a new one each time)
    respect: Respect = Respect()
    view: ViewOptions = ViewOptions()
    plate_look: PlateLook = PlateLook()

    def __post_init__(self) -> None:
        number(self, "frame", least=-(2**31), most=2**31 - 1)
