"""``filoplume groom MESH -o OUT``: a real animal in, a coat out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app.deliver import check_outputs, deliver, draw
from app.report import Report, peak_megabytes
from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.formats.mesh_file import read_mesh
from core.formats.picture import read_picture
from core.groom.dress import dress
from core.groom.groom import Map
from core.groom.grow import grow, measure
from core.groom.style import load_style
from core.record import freeze


def command(
    mesh: Annotated[Path, typer.Argument(help="The animal: OBJ, PLY, STL, OFF, GLB/glTF, USD, Alembic.", show_default=False)],
    output: Annotated[list[Path], typer.Option("--output", "-o", help="Where the coat goes; the suffix says how: .filo .usda .usdc .usdz .abc .hair. May be given again.", show_default=False)],
    guides: Annotated[int, typer.Option(min=1, max=1_000_000, help="Guides, exactly.")] = 4000,
    hairs: Annotated[int, typer.Option(min=0, max=20_000_000, help="Hairs grown from the guides, exactly.")] = 100_000,
    length: Annotated[float | None, typer.Option(min=1e-9, help="Length of a guide in metres; by default the preset's share of the animal's size.")] = None,
    density_map: Annotated[Path | None, typer.Option(help="Image read by UV: white grows, black does not.")] = None,
    length_map: Annotated[Path | None, typer.Option(help="Image read by UV: factor on the length of hairs.")] = None,
    preset: Annotated[str, typer.Option(help="short, fur, long or mane.")] = "fur",
    unit: Annotated[str | None, typer.Option(help="Unit of the file where it does not say: m, cm, mm, in, ft.")] = None,
    up: Annotated[str | None, typer.Option(help="Up axis of the file where it does not say: y or z.")] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Of everything random; the same seed gives the same coat.")] = 0,
    png: Annotated[Path | None, typer.Option(help="Also draw a picture of the coat.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Grow a coat on an animal: guides laid along the body, hairs grown from them, files written."""
    report = Report(as_json)
    style = load_style(preset)
    check_outputs(output, png)
    evaluator = Evaluator()
    with report.working(total=9 + len(output)):
        with report.stage("load", f"reading {mesh.name}"):
            source = read_mesh(mesh, unit=unit, up=up, say=report.note)
            maps = _maps(density_map, length_map)
        groom = dress(
            source.mesh, style, evaluator, guides, hairs, length, maps, "density" if density_map else None,
            "length" if length_map else None, seed, stage=report.stage,
        )
        children = grow(groom, source.mesh, evaluator, stage=report.stage)
        document = Document(meshes=(MeshObject(id=1, name=source.name, mesh=source.mesh),), grooms=(groom,))
        with report.stage("measure", "looking for hairs inside the skin"):
            figures = measure(groom, source.mesh, children, evaluator)
        for path in output:
            with report.stage(f"export_{path.suffix.lstrip('.')}", f"writing {path.name}"):
                deliver(path, document, {groom.id: children})
        if png is not None:
            with report.stage("export_picture", f"drawing {png.name}"):
                draw(png, document, {groom.id: children}, evaluator)
    outputs = [str(path) for path in [*output, *([png] if png else [])]]
    result = {
        "guides": len(groom.guides), "hairs": len(children), "points": len(children) * groom.coat.points,
        "root_error_max": figures.root_error_max, "inside_segments": figures.inside_segments,
        "seconds": report.seconds, "peak_mb": peak_megabytes(), "outputs": outputs,
        "problems": source.problems, "preset": preset, "seed": seed,
    }
    inside = "the skin is not closed" if figures.inside_segments is None else f"{figures.inside_segments} segments inside the skin"
    report.done(result, [
        f"{len(groom.guides):,} guides and {len(children):,} hairs on {source.name} "
        f"in {sum(report.seconds.values()):.1f} s; {inside}", *outputs,
    ])


def _maps(density_map: Path | None, length_map: Path | None) -> tuple[Map, ...]:
    pairs = (("density", density_map), ("length", length_map))
    return tuple(Map(name=name, image=_grey(path)) for name, path in pairs if path is not None)


def _grey(path: Path) -> np.ndarray:
    """A map image (H, W) float32: colours are averaged, alpha is left out."""
    pixels = read_picture(path)
    return freeze(pixels if pixels.ndim == 2 else pixels[..., :3].mean(axis=2, dtype=np.float32))
