"""``filoplume track``: points followed through a plate, with how sure each one is."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from app.commands.solve import options_of
from app.report import Report, peak_megabytes
from app.solving import check_outputs, solve_tracks
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.frame_decoder import FrameDecoder
from core.formats.mask_file import read_masks
from core.formats.plane_file import read_planes, write_planes
from core.formats.plate_file import PlateFrames, read_plate
from core.formats.track_file import SUFFIXES, read_tracks, write_tracks
from core.formats.tracks_json import Tracks
from core.image.mix import mixed
from core.image.plate import ChannelMix
from core.match.fill import fill_gaps
from core.match.follow import NOT_FOLLOWED, with_found
from core.match.outline import held_off
from core.match.plane_tracker import plane_steps
from core.match.track import MODELS, PlaneTrack, Track, TrackSettings
from core.match.tracker import Tracking
from core.workers import Workers


def command(
    plate: Annotated[str, typer.Argument(help="A folder of frames, a pattern like plate.####.exr, or a movie.", show_default=False)],
    tracks: Annotated[Path | None, typer.Option(help="Keys to follow: .json, or a file of another program.")] = None,
    tracks_out: Annotated[Path | None, typer.Option(help="Where the tracks go; the suffix says how.")] = None,
    masks: Annotated[Path | None, typer.Option(help="Outlines that hold tracks off, keyed over frames: .json.")] = None,
    planes: Annotated[Path | None, typer.Option(help="Flat pieces to follow as corner pins: .json.")] = None,
    planes_out: Annotated[Path | None, typer.Option(help="Where the corners of the planes go: .json.")] = None,
    auto: Annotated[int, typer.Option(min=0, max=20_000, help="Find so many features and keep as many alive.")] = 0,
    pattern: Annotated[int, typer.Option(min=7, max=201, help="Side of the pattern in pixels.")] = 21,
    search: Annotated[int, typer.Option(min=2, max=500, help="How far around the place foretold to look, in pixels.")] = 30,
    model: Annotated[str, typer.Option(help="translation, similarity, affine, homography, or auto: what the picture earns.")] = "auto",
    blur: Annotated[bool, typer.Option("--blur", help="The plate has motion blur: blur the patterns alike.")] = False,
    grey: Annotated[bool, typer.Option("--grey", help="Look at one grey instead of three colours.")] = False,
    log: Annotated[bool, typer.Option("--log", help="Look at stops of light; for linear and dark plates.")] = False,
    denoise: Annotated[float, typer.Option(min=0.0, max=10.0, help="Take out grain of so many pixels first.")] = 0.0,
    contrast: Annotated[float, typer.Option(min=0.0, max=2000.0, help="Even out contrast over so many pixels; for dark plates.")] = 0.0,
    fill: Annotated[bool, typer.Option("--fill", help="Fill the gaps of tracks by optical flow.")] = False,
    frames: Annotated[str | None, typer.Option(help="First and last frame, as 1001-1100; all of them otherwise.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page with curves and pictures: .html.")] = None,
    solved: Annotated[bool, typer.Option("--solve", help="Solve the camera from the tracks; -o says where it goes.")] = False,
    output: Annotated[list[Path] | None, typer.Option("-o", "--output", help="Where the solved camera goes, the suffix says how; more than one may be given.")] = None,
    solve_report: Annotated[Path | None, typer.Option(help="Write a page that says how good the solve is: .html.")] = None,
    focal_px: Annotated[float | None, typer.Option(min=1.0, max=1e7, help="The focal length in pixels, for --solve; found otherwise.")] = None,
    free_focal: Annotated[bool, typer.Option("--free-focal", help="Find the focal length too, from --focal-px if it is given.")] = False,
    zoom: Annotated[bool, typer.Option("--zoom", help="The focal length changes over the shot.")] = False,
    lens: Annotated[str, typer.Option(help="Find the bend of the lens too: brown, fisheye, radial4, anamorphic4.")] = "none",
    nodal: Annotated[bool, typer.Option("--nodal", help="The camera only turns, as on a tripod.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Follow points through a plate: given keys, features found by themselves, or both."""
    if tracks is None and not auto and planes is None:
        raise typer.BadParameter("say what to track: --tracks KEYS.json, --auto 40, or --planes PLANES.json")
    if (planes is None) != (planes_out is None):
        raise typer.BadParameter("planes go in and out: --planes PLANES.json --planes-out CORNERS.json")
    if model != "auto" and model not in MODELS:
        raise typer.BadParameter(f"choose auto or one of {', '.join(MODELS)}", param_hint="--model")
    _check_outputs(tracks_out, report, planes_out)
    if (output or solve_report) and not solved:
        raise typer.BadParameter("-o and --solve-report are of a solved camera: add --solve", param_hint="--output")
    asked = options_of(focal_px, free_focal, zoom, nodal, lens)
    check_outputs(output or (), solve_report)
    telling = Report(as_json)
    workers, decoder = Workers(), FrameDecoder()
    warnings: list[str] = []
    try:
        with telling.working(total=(5 if solved else 3) + fill):
            with telling.stage("read", "looking at the plate"):
                film = read_plate(plate, decoder)
                span = _span(frames, film.frames)
                given = read_tracks(tracks, size=(film.width, film.height)) if tracks is not None else Tracks(())
                keyed = _keyed(given, (film.width, film.height), span, warnings)
                shapes = read_masks(masks) if masks is not None else ()
                flat = read_planes(planes) if planes is not None else ()
            mix = ChannelMix(channels="grey" if grey else "rgb", log=log, denoise=denoise, contrast=contrast)
            source = PlateFrames(film, decoder)
            settings = TrackSettings(pattern=pattern | 1, search=search, model=model, blur=blur)

            def read(frame: int) -> Any:
                pixels = source.get(frame)
                return None if pixels is None else mixed(pixels, mix)

            def hold(frame: int) -> Any:
                return held_off(shapes, frame, film.height, film.width)

            tracking = Tracking(read, span, keyed, settings, auto=auto, ranges=workers.ranges, hold=hold)
            with telling.stage("track", "tracking"):
                begin = time.perf_counter()
                for step in tracking.steps():
                    telling.words(f"tracking, frame {step.frame}: {len(step.tracks)} tracks")
                seconds = time.perf_counter() - begin
                pins = tuple(_followed(plane, read, span, settings, workers, hold, telling) for plane in flat)
                was = {track.id: track for track in keyed}
                made = tuple(
                    with_found(was[track.id], track, span) if track.id in was else track for track in tracking.tracks())
            if fill:
                with telling.stage("fill", "filling gaps"):
                    made = fill_gaps(made, read, ranges=workers.ranges)
            warnings += _film_warnings(film.missing, source.broken, span)
            found = len(made) - len(keyed)
            if found < auto:
                warnings.append(f"{found} of {auto} features were found and followed; the plate shows no more corners that are sure")
            warnings += _track_warnings(made, span) + [
                f"plane {plane.name} is seen on {len(plane.frames)} of {len(span)} frames"
                for plane in pins if len(plane.frames) < len(span)]
            with telling.stage("write", "writing"):
                if tracks_out is not None:
                    with atomic_write(tracks_out) as beside:
                        write_tracks(beside, Tracks(made, (film.width, film.height), (span[0], span[-1])), tracks_out.suffix)
                if planes_out is not None:
                    with atomic_write(planes_out) as beside:
                        write_planes(beside, pins, (film.width, film.height))
                if report is not None:
                    from app.track_report import write_report

                    with atomic_write(report) as beside:
                        write_report(beside, film, made, settings, source.get, warnings)
            done = None
            if solved:
                done = solve_tracks(
                    made, (film.width, film.height), asked, output or (), solve_report, telling, film.name, source.get)
                warnings += done.told.warnings
        source.close()
    finally:
        decoder.close()
        workers.close()
    for words in warnings:
        telling.note(words)
    written = [str(path) for path in (tracks_out, planes_out, report) if path is not None]
    result = {
        "plate": film.name, "size": [film.width, film.height], "frames": [span[0], span[-1]], "tracks": len(made), "planes": len(pins),
        "observations": sum(len(track.frames) for track in made), "seconds": telling.seconds,
        "ms_per_track_frame": round(1e3 * seconds / tracking.observations, 4) if tracking.observations else 0.0, "warnings": warnings, "outputs": written,
        "peak_mb": peak_megabytes(),
    }
    if done is not None:
        result["solve"] = {key: done.result[key] for key in done.result.keys() - {"seconds", "peak_mb", "outputs"}}
        written += done.result["outputs"]
    lines = [f"{len(made)} tracks, {result['observations']:,} points on frames {span[0]} to {span[-1]}, {seconds:.1f} s", *written]
    lines += done.lines if done is not None else []
    telling.done(result, lines)


def _followed(
    drawn: PlaneTrack, read: Any, span: range, settings: TrackSettings, workers: Workers, hold: Any, telling: Report
) -> PlaneTrack:
    """The plane after it was followed through the plate."""
    plane = drawn
    for plane in plane_steps(drawn, read, span, settings=settings, ranges=workers.ranges, hold=hold):
        telling.words(f"tracking plane {plane.name}, {len(plane.frames)} frames")
    return plane


def _check_outputs(tracks_out: Path | None, report: Path | None, planes_out: Path | None) -> None:
    if planes_out is not None and planes_out.suffix.lower() != ".json":
        raise UserError(f"{planes_out.name}: planes are written as .json; give a name that ends so")
    if tracks_out is not None and tracks_out.suffix.lower() not in SUFFIXES:
        raise UserError(f"{tracks_out.name}: tracks are written as {', '.join(SUFFIXES)}; choose one of these suffixes")
    if report is not None and report.suffix.lower() not in (".html", ".htm"):
        raise UserError(f"{report.name}: the report is a page; give a name that ends in .html")
    for path in (tracks_out, report, planes_out):
        if path is not None and not path.resolve().parent.is_dir():
            raise UserError(f"the folder {path.resolve().parent} does not exist; make it first")


def _span(words: str | None, there: range) -> range:
    if words is None:
        return there
    first, _, last = words.lstrip("-").partition("-")
    try:
        start = int(words[: len(words) - len(words.lstrip("-"))] + first)
        end = int(last) if last else start
    except ValueError:
        raise typer.BadParameter("give two frames as 1001-1100", param_hint="--frames") from None
    span = range(max(start, there[0]), min(end, there[-1]) + 1)
    if not span:
        raise UserError(f"the plate has frames {there[0]} to {there[-1]}, none of {words}")
    return span


def _keyed(given: Tracks, size: tuple[int, int], span: range, warnings: list[str]) -> tuple[Track, ...]:
    if given.size is not None and given.size != size:
        raise UserError(f"the tracks are of a plate of {given.size[0]} x {given.size[1]} pixels, this one has {size[0]} x {size[1]}")
    for track in given.tracks:
        outside = [int(f) for f, x, y in track.keys if not (-0.5 <= x <= size[0] - 0.5 and -0.5 <= y <= size[1] - 0.5)]
        if outside:
            raise UserError(f"track {track.name} has its key of frame {outside[0]} outside of the picture")
        if not any(int(frame) in span for frame in track.keys[:, 0]):
            warnings.append(f"track {track.name} has no key on frames {span[0]} to {span[-1]} and was left as it was")
    return given.tracks


def _film_warnings(missing: tuple[int, ...], broken: dict[int, str], span: range) -> list[str]:
    gone = [n for n in missing if n in span]
    words = [f"frame {n} is missing" for n in gone[:20]]
    if len(gone) > 20:
        words.append(f"{len(gone) - 20} more frames are missing")
    return words + [sentence for frame, sentence in sorted(broken.items()) if frame not in missing]


def _track_warnings(tracks: tuple[Track, ...], span: range) -> list[str]:
    words = []
    for track in tracks:
        if len(track.frames) and not track.name.startswith("auto"):
            if len(track.frames) <= len(track.keys) < len(span):
                words.append(NOT_FOLLOWED.format(track.name))
            elif track.frames[-1] < span[-1]:
                words.append(f"track {track.name} ends at frame {track.frames[-1]}")
            gaps = int(track.frames[-1] - track.frames[0] + 1 - len(track.frames))
            if gaps:
                words.append(f"track {track.name} is out of sight on {gaps} frame{'s' if gaps > 1 else ''}")
    return words
