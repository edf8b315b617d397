"""``filoplume bake FILE --frames A-B``: the feathers of a project, one file for every frame, over a pool of processes."""

from __future__ import annotations

import functools
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Annotated

import typer

from app.deliver import posed_document
from app.feather_frames import (
    CURVES,
    Figures,
    Form,
    coat_looks,
    export_frame,
    form_of,
    frame_range,
    say_beyond_clips,
    worse,
)
from app.report import Report, peak_megabytes
from core.document import find_mesh, keys_of
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.export import added_at_rest
from core.feather.coat.plumage import Plumage
from core.formats.atomic import atomic_write
from core.formats.curve_file import maker
from core.formats.project import read_project
from core.formats.usd_feathers import FeatherWriter
from core.workers import Workers


def command(
    file: Annotated[Path, typer.Argument(help="The project, a .filo with feathers.", show_default=False)],
    frames: Annotated[str, typer.Option(help="Frames to bake, as A-B.", show_default=False)],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder the files go to; beside the project when not given.", show_default=False)] = None,
    processes: Annotated[int, typer.Option(min=1, max=256, help="Frames baked at once; by default one for each core.")] = os.cpu_count() or 1,
    each: Annotated[bool, typer.Option("--meshes", help="Write every feather's own shape instead of instances.")] = False,
    nurbs: Annotated[bool, typer.Option("--nurbs", help="Write every vane as a NURBS patch and the shafts as NURBS curves.")] = False,
    curves: Annotated[str | None, typer.Option(help=f"Write curves for hair renderers: {', '.join(CURVES)}.")] = None,
    barbs: Annotated[int | None, typer.Option(min=1, max=2000, help="Barbs a side at most, wider by what is left out; all when not given.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Bake every frame by itself: no frame reads another, so that any may be baked again, anywhere, in any order."""
    report = Report(as_json)
    wanted, form = frame_range(frames), form_of(each, nurbs, curves)
    assert wanted is not None  # the option is required
    if file.suffix.lower() != ".filo":
        raise UserError(f"{file.name} is no project; save one with feathers as .filo and bake that")
    document = read_project(file).document
    shown = [coat for coat in document.feathers if not coat.hidden]
    if not shown:
        raise UserError(f"{file.name} has no feathers that are shown; there is nothing to bake")
    folder = file.resolve().parent if output is None else output
    if not folder.is_dir():
        raise UserError(f"the folder {folder} does not exist; make it first")
    say_beyond_clips(document, wanted, report)
    numbers = range(wanted[0], wanted[1] + 1)
    jobs = [(str(file), coat.id, frame, str(_place(folder, file, coat.name, frame)), form, barbs)
            for coat in shown for frame in numbers]
    figures: Figures = {}
    with report.working(total=len(jobs)), report.stage("bake", f"baking {len(jobs)} frames"):
        for made in _all(jobs, min(processes, len(jobs))):
            figures = worse(figures, made)
    outputs = [job[3] for job in jobs]
    result = {
        "frames": len(numbers), **figures, "seconds": report.seconds, "peak_mb": peak_megabytes(), "outputs": outputs,
    }
    report.done(result, [f"{len(jobs)} files, at most {figures['crossings']} crossings in one", *outputs[:3]])


def _place(folder: Path, file: Path, name: str, frame: int) -> Path:
    plain = "".join(c if c.isalnum() else "_" for c in name)
    return folder / f"{file.stem}.{plain}.{frame:04d}.usdc"


Job = tuple[str, int, int, str, Form, int | None]


def _all(jobs: list[Job], processes: int) -> list[Figures]:
    if processes == 1:
        return [bake_frame(job) for job in jobs]
    # fresh processes: OpenUSD and threads do not survive a fork
    with ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        return list(pool.map(bake_frame, jobs))


class _Coat:
    """A coat of a project, kept by a process between frames: the static part of the work is done once."""

    def __init__(self, file: str, coat_id: int) -> None:
        self.evaluator = Evaluator(workers=Workers(1))
        self.document = read_project(file).document
        self.coat = next(coat for coat in self.document.feathers if coat.id == coat_id)
        self.plumage = Plumage(self.evaluator)
        item, keys = find_mesh(self.document, self.coat.mesh_id), keys_of(self.document, self.coat)
        rest = self.plumage.at_rest(self.coat, keys, item.mesh, float(self.document.first_frame))
        self.added = added_at_rest(rest, self.evaluator.workers)


@functools.lru_cache(maxsize=1)
def _opened(file: str, coat_id: int, _written: int) -> _Coat:
    """The coat of a project as it was written at a time."""
    return _Coat(file, coat_id)


def bake_frame(job: Job) -> Figures:
    """Bake one frame of one coat into its file; what it has to say of itself."""
    file, coat_id, frame, path, form, barbs = job
    kept = _opened(file, coat_id, os.stat(file).st_mtime_ns)
    item = find_mesh(kept.document, kept.coat.mesh_id)
    skin = posed_document(kept.document, float(frame), kept.evaluator)[item.id]
    laid = kept.plumage.at_frame(
        kept.coat, keys_of(kept.document, kept.coat), item.mesh, skin, float(frame), float(kept.document.first_frame))
    written, figures = export_frame(laid, kept.coat, float(frame), form, kept.evaluator, kept.added, barbs)
    with atomic_write(path) as temporary:
        writer = FeatherWriter(
            temporary, kept.coat.name, item.mesh, maker(), coat_looks(kept.coat), True, kept.document.fps)
        writer.write(written)
        writer.close(float(frame), float(frame))
    return figures
