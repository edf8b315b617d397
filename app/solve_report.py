"""The report of a solve: one page that needs nothing beside it, with curves, the path from above, and what to mend."""

from __future__ import annotations

from html import escape
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.page import STYLE, Read, bytes_of, picture_data
from core.match.lens import coefficients, model_of
from core.match.solve.parallax import parallax_degrees
from core.match.solve.report import Report
from core.match.solve.solution import Solution
from core.match.solve.state import Array, projected

MOST_TRACKS = 300
WIDE, HIGH, LEFT, BOTTOM = 560, 150, 44, 20
GOOD, POOR = 1.0, 2.5  # of the typical error: green to red


def write_report(
    path: Path, solution: Solution, told: Report, names: list[str], title: str, read: Read | None = None
) -> None:
    """Write the page; `read` gives a frame of the plate by its number, for the picture of what was seen and is told."""
    known, state = solution.known, solution.state
    frames = solution.frames
    focal = told.focal_px[known]
    parallax = parallax_degrees(solution)
    coded = ", ".join(f"{name} {value:+.5g}" for name, value in coefficients(state.lens).items())
    facts = (
        ("kind", told.kind), ("cameras", f"{known.sum()} of {len(known)}"),
        ("points", f"{solution.held.sum()} of {len(names)}"), ("observations", f"{solution.used.sum():,}"),
        ("median", f"{told.median_px:.3f} px"), ("mean", f"{told.mean_px:.3f} px"), ("RMS", f"{told.rms_px:.3f} px"),
        ("95 %", f"{told.p95_px:.3f} px"), ("maximum", f"{told.most_px:.2f} px"),
        ("focal length", f"{focal.min():.1f} px" + (f" to {focal.max():.1f} px" if np.ptp(focal) > 1e-6 else "")),
        ("its doubt", f"{told.focal_sigma_px:.2f} px" if told.focal_sigma_px else "given"),
        ("doubt of the path", f"{100 * told.path_sigma:.2f} % of its size"),
        ("parallax", f"{np.nanmedian(parallax):.1f} degrees in the median"),
        ("lens", f"{model_of(state.lens).name}: {coded}"),
    )
    page = f"""<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
<title>{escape(title)}: solve</title><style>{STYLE}{MORE}</style>
<h1>{escape(title)}</h1>
<p class=sub>frames {frames[0]} to {frames[-1]}, {solution.size[0]} x {solution.size[1]} pixels</p>
<dl>{"".join(f"<div><dt>{name}<dd>{escape(value)}</div>" for name, value in facts)}</dl>
<h2>{"What may be wrong" if told.warnings else "Nothing speaks against this solve"}</h2>
{"".join(f"<p class=note>{escape(words)}</p>" for words in told.warnings)}
<h2>{"What to mend next" if told.advice else "There is nothing to mend"}</h2>
<ol>{"".join(f"<li>{escape(words)}" for words in told.advice)}</ol>
{_picture(solution, told, read)}
<div class=charts>
<figure>{_curve(frames, told.by_frame, "#3a6fd0")}<figcaption>Reprojection error of every frame, RMS in pixels</figure>
<figure>{_bars(told.by_track, names)}<figcaption>Reprojection error of every track, RMS in pixels, worst first</figure>
<figure>{_curve(frames, np.where(known, told.focal_px, np.nan), "#a3742a", zero=False, doubt=told.focal_sigma_px)}
<figcaption>Focal length in pixels{", with its standard deviation" if told.focal_sigma_px else ""}</figure>
<figure>{_curve(frames, _counts(solution), "#3a8a4a")}<figcaption>Tracks used on every frame</figure>
</div>
<h2>From above</h2>{_above(solution, told)}
<p class=sub>Cameras blue, keyframes darker; points from green to red by their error, with the ellipse of one standard
deviation.</p>
<h2>Tracks</h2><table><tr><th>track<th>frames<th>error, px<th>parallax<th>doubt of its place<th>without it</tr>
{_rows(solution, told, names, parallax)}</table></html>"""
    path.write_text(page, encoding="utf-8")


MORE = """
h2{font-size:1.05rem;margin:1.6rem 0 .5rem} dl{display:flex;flex-wrap:wrap;gap:.3rem 1.6rem;margin:0}
dt{color:#777;font-size:.8rem} dd{margin:0;font-variant-numeric:tabular-nums}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(480px,1fr));gap:1rem} figure{margin:0}
figcaption{color:#777;font-size:.85rem} svg{width:100%;height:auto} svg text{font-size:10px;fill:#888}
li{margin:.2rem 0} .axis{stroke:#8886;stroke-width:1}
"""


def _scaled(low: float, high: float) -> tuple[float, float, str]:
    """Ends of an axis and how its numbers are written."""
    if high - low < 1e-9 * max(abs(high), 1.0):
        low, high = low - 0.5, high + 0.5
    return low, high, ".3g" if max(abs(low), abs(high)) < 100 else ".1f"


def _frame_of_chart(low: float, high: float, ends: tuple[str, str]) -> str:
    low, high, form = _scaled(low, high)
    base = HIGH - BOTTOM
    return (
        f"<path class=axis fill=none d='M{LEFT} 6V{base}H{WIDE}'/><text x={LEFT - 4} y=12 text-anchor=end>{high:{form}}"
        f"</text><text x={LEFT - 4} y={base} text-anchor=end>{low:{form}}</text>"
        f"<text x={LEFT} y={HIGH - 6}>{ends[0]}</text>"
        f"<text x={WIDE} y={HIGH - 6} text-anchor=end>{ends[1]}</text>"
    )


def _svg(inside: str, height: float = HIGH) -> str:
    return f'<svg viewBox="0 0 {WIDE + 6} {height}" role=img>{inside}</svg>'


def _curve(
    frames: NDArray[np.int32], values: Array, colour: str, *, zero: bool = True, doubt: float = 0.0
) -> str:
    """A curve over frames, broken where there is no value; `doubt` is drawn as a band about it."""
    fine = np.isfinite(values)
    if not fine.any():
        return _svg("")
    low = 0.0 if zero else float(values[fine].min() - max(2.0 * doubt, 0.01 * abs(values[fine].min())))
    high = float(values[fine].max() + (0.0 if zero else max(2.0 * doubt, 0.01 * abs(values[fine].max()))))
    low, high, _ = _scaled(low, high)
    x = LEFT + (frames - frames[0]) / max(int(frames[-1] - frames[0]), 1) * (WIDE - LEFT)

    def y(value: Array) -> Array:
        return np.asarray(HIGH - BOTTOM - (value - low) / (high - low) * (HIGH - BOTTOM - 6))

    words, before = [], False
    for place, height, there in zip(x, y(values), fine, strict=True):
        if there:
            words.append(f"{'L' if before else 'M'}{place:.1f} {height:.1f}")
        before = bool(there)
    band = ""
    if doubt:
        up, down = y(values[fine] + doubt), y(values[fine] - doubt)
        corners = [*zip(x[fine], up, strict=True), *zip(x[fine][::-1], down[::-1], strict=True)]
        band = f'<polygon fill="{colour}" opacity=.2 points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in corners)}"/>'
    line = f'<path d="{"".join(words)}" fill=none stroke="{colour}" stroke-width=1.5 />'
    return _svg(_frame_of_chart(low, high, (str(frames[0]), str(frames[-1]))) + band + line)


def _bars(values: Array, names: list[str]) -> str:
    order = np.argsort(-np.nan_to_num(values, nan=-1.0))[: int(np.isfinite(values).sum())]
    if not len(order):
        return _svg("")
    high, typical = float(values[order[0]]), float(np.median(values[order]))
    wide = (WIDE - LEFT) / len(order)
    bars = "".join(
        f'<rect x={LEFT + k * wide:.2f} y={HIGH - BOTTOM - values[row] / high * (HIGH - BOTTOM - 6):.1f} width='
        f'{max(wide * 0.85, 0.3):.2f} height={values[row] / high * (HIGH - BOTTOM - 6):.1f} '
        f'fill="{_colour(values[row] / typical)}"><title>{escape(names[row])}: {values[row]:.3f} px</title></rect>'
        for k, row in enumerate(order)
    )
    return _svg(_frame_of_chart(0.0, high, (escape(names[order[0]]), escape(names[order[-1]]))) + bars)


def _colour(share: float) -> str:
    """Green at the typical error and below, red far above it."""
    bad = float(np.clip((share - GOOD) / (POOR - GOOD), 0.0, 1.0))
    return f"rgb({round(60 + 160 * bad)},{round(150 - 80 * bad)},{round(80 - 20 * bad)})"


def _counts(solution: Solution) -> Array:
    return np.bincount(solution.observations.frame[solution.used], minlength=len(solution.frames)).astype(np.float64)


def _above(solution: Solution, told: Report) -> str:
    """Path and points seen from above, what lies far out cut off, with ellipses of one standard deviation."""
    known, held = np.flatnonzero(solution.known), np.flatnonzero(solution.held)
    centres, points = solution.state.centres()[known][:, [0, 2]], solution.state.points[held][:, [0, 2]]
    both = np.concatenate([centres, points])
    low, high = np.quantile(both, 0.02, axis=0), np.quantile(both, 0.98, axis=0)
    low, high = np.minimum(low, centres.min(axis=0)), np.maximum(high, centres.max(axis=0))
    size = max(float((high - low).max()) * 1.08, 1e-9)
    middle, tall = 0.5 * (low + high), 380.0
    scale = min((WIDE - 20) / max(high[0] - low[0], 1e-9), (tall - 20) / max(high[1] - low[1], 1e-9)) / 1.05

    def at(place: Array) -> tuple[float, float]:
        return 0.5 * WIDE + (place[0] - middle[0]) * scale, 0.5 * tall - (place[1] - middle[1]) * scale

    drawn = []
    typical = float(np.nanmedian(told.by_track))
    for row, place in zip(held, points, strict=True):
        x, y = at(place)
        if not (-20 < x < WIDE + 20 and -20 < y < tall + 20):
            continue
        colour = _colour(float(told.by_track[row]) / typical) if np.isfinite(told.by_track[row]) else "#999"
        spread = told.point_sigma[row][np.ix_([0, 2], [0, 2])]
        if np.isfinite(spread).all():
            sizes, axes = np.linalg.eigh(spread)
            a, b = np.sqrt(np.maximum(sizes, 0.0)) * scale
            if b > 0.3 and b < 0.5 * size * scale:
                turn = -float(np.degrees(np.arctan2(axes[1, 1], axes[0, 1])))
                drawn.append(f'<ellipse cx={x:.1f} cy={y:.1f} rx={b:.2f} ry={a:.2f} fill="{colour}" opacity=.25 '
                             f'transform="rotate({turn:.1f} {x:.1f} {y:.1f})"/>')
        drawn.append(f'<circle cx={x:.1f} cy={y:.1f} r=2 fill="{colour}"/>')
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(at, centres))
    drawn.append(f'<polyline points="{line}" fill=none stroke="#3a6fd0" stroke-width=1.5 />')
    ahead = solution.state.rotation[known][:, 2][:, [0, 2]]
    every = set(solution.keys) | {int(known[0]), int(known[-1])}
    for row, centre, look in zip(known, centres, ahead, strict=True):
        if int(row) in every:
            side = np.array([-look[1], look[0]])
            corners = [at(centre), *(at(centre + (14 * look + way * side) / scale) for way in (6, -6))]
            shape = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
            drawn.append(f'<polygon points="{shape}" fill="#3a6fd055" stroke="#2a4f9a"><title>frame '
                         f"{solution.frames[row]}</title></polygon>")
    return _svg("".join(drawn), tall)


def _picture(solution: Solution, told: Report, read: Read | None) -> str:
    """The worst frame of the plate: what was seen as circles, where the solve says it is as lines ten times as long."""
    if read is None or not np.isfinite(told.by_frame).any():
        return ""
    row = int(np.nanargmax(told.by_frame))
    pixels = read(int(solution.frames[row]))
    if pixels is None:
        return ""
    image = np.ascontiguousarray(bytes_of(pixels))
    rows = np.flatnonzero(solution.used & (solution.observations.frame == row))
    part = solution.observations.take(rows)
    where, _ = projected(solution.state, part.frame, solution.state.points[part.track])
    size = max(1, round(image.shape[1] / 640))
    for seen, said in zip(part.xy, where, strict=True):
        miss = float(np.linalg.norm(said - seen))
        bad = float(np.clip(miss / max(told.median_px, 1e-9) / 4.0, 0.0, 1.0))
        colour = (60, round(200 - 150 * bad), round(60 + 180 * bad))
        ends = [tuple(int(v) for v in np.round(end * 16)) for end in (seen, seen + 10.0 * (said - seen))]
        cv2.circle(image, ends[0], 4 * size * 16, colour, size, cv2.LINE_AA, 4)
        cv2.line(image, ends[0], ends[1], colour, size, cv2.LINE_AA, 4)
    words = f"Frame {solution.frames[row]}, the worst: tracks, and ten times how far the solve puts them off."
    return f'<h2>Seen and told</h2><img class=f alt="" src="{picture_data(image, ".jpg")}"><p class=sub>{words}</p>'


def _rows(solution: Solution, told: Report, names: list[str], parallax: Array) -> str:
    without = {fix.row: f"{fix.rms_px:.3f} px" for fix in told.fixes if fix.kind == "track"}
    order = np.argsort(-np.nan_to_num(told.by_track, nan=np.inf))[:MOST_TRACKS]
    centre = solution.state.centres()[solution.known].mean(axis=0)
    made = []
    for row in order:
        own = solution.observations.track == row
        frames = solution.frames[solution.observations.frame[own]]
        spread, place = told.point_sigma[row], solution.state.points[row]
        doubt = ""
        if np.isfinite(spread).all():
            size = float(np.sqrt(max(np.linalg.eigvalsh(spread)[-1], 0.0)))
            doubt = f"{100 * size / max(float(np.linalg.norm(place - centre)), 1e-12):.2f} % of its distance"
        error = f"{told.by_track[row]:.3f}" if np.isfinite(told.by_track[row]) else "left out"
        span = f"{frames.min()}&ndash;{frames.max()}" if len(frames) else ""
        angle = f"{parallax[row]:.1f}&deg;" if np.isfinite(parallax[row]) else ""
        made.append(f"<tr><td>{escape(names[row])}<td class=n>{span}<td class=n>{error}<td class=n>{angle}"
                    f"<td class=n>{doubt}<td class=n>{without.get(int(row), '')}")
    return "".join(made)
