"""``filoplume bench [NAME]``: the table of measured figures."""

from __future__ import annotations

import importlib
import json
import pkgutil
import sys
from typing import Annotated

import typer

from core.errors import UserError

NOT_BENCHMARKS = {"bench", "comb_targets"}  # what the others are made of


def command(
    name: Annotated[str | None, typer.Argument(help="One benchmark; without it, all of them.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the table as Markdown, for the docs.")] = False,
) -> None:
    """Measure, beside the figure to reach. FILOPLUME_PEERS=PYTHON adds Blender, run in the same go."""
    names = benchmark_names()
    if name is not None and name not in names:
        raise UserError(f"there is no benchmark {name}; there are {', '.join(names)}")
    tables = {}
    for one in [name] if name else names:
        module = importlib.import_module(f"tests.bench.{one}")
        try:
            rows = module.run()
        except UserError as error:
            if name is not None:
                raise
            print(f"\n{module.TITLE}: not measured, {error}", file=sys.stderr)
            continue
        tables[one] = [dict(row._asdict(), reached=_reached(row)) for row in rows]
        if not as_json:
            _show(module.TITLE, tables[one], markdown)
    if as_json:
        print(json.dumps(tables))


def benchmark_names() -> list[str]:
    """The benchmarks of this checkout (an installed program has none)."""
    try:
        package = importlib.import_module("tests.bench")
    except ModuleNotFoundError as error:
        raise UserError("benchmarks are part of the checkout: run this from its folder") from error
    return sorted(m.name for m in pkgutil.iter_modules(package.__path__) if m.name not in NOT_BENCHMARKS)


def _reached(row) -> bool | None:  # type: ignore[no-untyped-def]
    if row.target is None:
        return None
    return bool(row.measured >= row.target if row.at_least else row.measured <= row.target)


def _show(title: str, rows: list[dict], markdown: bool) -> None:  # type: ignore[type-arg]
    words = {True: "reached", False: "MISSED", None: ""}
    if markdown:
        print(f"\n### {title}\n\n| what | measured | to reach | |\n| --- | ---: | ---: | --- |")
    else:
        print(f"\n{title}")
    for row in rows:
        sign = ">=" if row["at_least"] else "<="
        target = "" if row["target"] is None else f"{sign} {row['target']:g} {row['unit']}"
        measured = f"{row['measured']:.4g} {row['unit']}"
        if markdown:
            print(f"| {row['what']} | {measured} | {target} | {words[row['reached']]} |")
        else:
            print(f"  {row['what']:<78} {measured:>14}   {target:<16} {words[row['reached']]}")
