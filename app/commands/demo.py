"""``filoplume demo``: what ``make run`` does until the window exists."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.commands import groom as groom_command
from app.deliver import deliver, draw
from app.report import Report
from core.demo import demo_document
from core.evaluator import Evaluator
from core.groom.grow import grow


def command(
    mesh: Annotated[Path | None, typer.Option(help="Another animal than the demo's.")] = None,
    folder: Annotated[Path, typer.Option(help="Where the files go.")] = Path("out"),
    hairs: Annotated[int, typer.Option(min=0, max=20_000_000, help="Hairs to grow.")] = 120_000,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Groom the demo animal and write demo.filo, demo.usdc and demo.png."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / "demo.filo", folder / "demo.usdc"]
    if mesh is not None:
        groom_command.command(mesh, files, hairs=hairs, png=folder / "demo.png", as_json=as_json)
        return
    report, evaluator = Report(as_json), Evaluator()
    with report.working(total=11):
        document = demo_document(evaluator, hairs, stage=report.stage)
        groom = document.grooms[0]
        children = {groom.id: grow(groom, document.meshes[0].mesh, evaluator, stage=report.stage)}
        for path in files:
            with report.stage(f"export_{path.suffix[1:]}", f"writing {path}"):
                deliver(path, document, children)
        with report.stage("export_picture", "drawing the coat"):
            draw(folder / "demo.png", document, children, evaluator)
    outputs = [*map(str, files), str(folder / "demo.png")]
    report.done({"outputs": outputs, "seconds": report.seconds}, ["the demo animal has its coat:", *outputs])
