"""The command line: a table of commands, and one place where errors become words and exit codes.

Exit codes: 0 done, 1 could not (one sentence on standard error), 2 wrong usage, 130 stopped by Ctrl-C.
With ``--json`` standard output carries one object and nothing else: the result, or ``{"error": "..."}``.
"""

from __future__ import annotations

import ast
import importlib
import json
import os
import sys
import threading
import traceback
from pathlib import Path

import typer

from core.errors import UserError
from core.kernel_cache import kernels_compiled

# name of the command -> module of app.commands that holds a function `command`; order is the order of --help
COMMANDS = (
    "window", "groom", "feather", "feathers", "convert", "info", "check", "render", "pose", "track",
    "flow", "retime", "solve", "grid", "stmap", "photomodel", "run", "bake", "publish", "bench", "doctor", "demo",
)
HELP = ("-h", "--help")
COMPILING_AFTER = 4.0  # seconds of loading a command, which take one or two when its kernels are in the cache


# typer carries a click of its own; this is its base class of everything said wrongly on the command line
UsageError = typer.BadParameter.__base__


def build(names: tuple[str, ...] = COMMANDS) -> typer.Typer:
    """The typer application with these commands; a command's module is only loaded when it is named."""
    cli = _empty()
    for name in names:
        module = importlib.import_module(f"app.commands.{name}")
        cli.command(name, no_args_is_help=name not in ("window", "bench", "doctor", "demo"))(module.command)
    return cli


def overview() -> typer.Typer:
    """The list of all commands with the words of their docstrings; none of their modules is loaded for it."""
    cli = _empty()
    for name in COMMANDS:
        tree = ast.parse((Path(__file__).parent / "commands" / f"{name}.py").read_text("utf-8"))
        found = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "command")
        cli.command(name, help=ast.get_docstring(found))(lambda: None)
    return cli


def _empty() -> typer.Typer:
    return typer.Typer(
        name="filoplume",
        help="Groom hair, set feathers, correct poses, match plates: by hand in a window, or files in and files out.",
        no_args_is_help=True,
        epilog="Without a command the window opens: filoplume [FILE], see filoplume window --help.",
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )


def main(arguments: list[str] | None = None) -> None:
    """Run one command and leave with its exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    as_json = "--json" in arguments
    try:
        code = _run(arguments)
    except UsageError as error:
        if as_json:
            print(json.dumps({"error": error.format_message()}))
        error.show()
        code = 2
    except typer.Exit as error:
        code = error.exit_code
    except (typer.Abort, KeyboardInterrupt):
        code = _fail("stopped; nothing half-written was left", as_json, 130)
    except UserError as error:
        code = _fail(str(error), as_json, 1)
    except BrokenPipeError:  # the reader of a pipe went away: not an error worth words
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    except MemoryError:
        code = _fail("there is not enough memory for this; try fewer hairs or a lighter mesh", as_json, 1)
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        code = _fail(f"{(error.strerror or str(error)).lower()}{where}", as_json, 1)
    except Exception as error:
        if os.environ.get("FILOPLUME_DEBUG"):
            traceback.print_exc()
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{os.path.basename(where.filename)}:{where.lineno}"
        code = _fail(
            f"this is a fault of filoplume ({type(error).__name__} at {place}: {error}); "
            "FILOPLUME_DEBUG=1 shows the whole trace", as_json, 1,
        )
    raise SystemExit(code)


def _run(arguments: list[str]) -> int:
    if _wants_window(arguments):
        arguments = ["window", *arguments]
    chosen = next((a for a in arguments if not a.startswith("-")), None)
    cli = overview() if chosen not in COMMANDS else _with(chosen)
    command = typer.main.get_command(cli)
    return command(args=arguments, prog_name="filoplume", standalone_mode=False) or 0


def _with(chosen: str) -> typer.Typer:
    """The application with one command. Loading it compiles its kernels the first time, which is said when it lasts."""
    said = threading.Timer(COMPILING_AFTER, lambda: print(
        "filoplume: compiling for the first time, which may take a minute", file=sys.stderr))
    said.daemon = True
    if not kernels_compiled():
        said.start()
    try:
        # one command alone would lose its name, so a second, light one stands beside it
        return build((chosen, "bench" if chosen == "run" else "run"))
    finally:
        said.cancel()


def _wants_window(arguments: list[str]) -> bool:
    """True without a command: no words at all, options of the window, or a file (a mistyped command is none)."""
    if not arguments:
        return True
    first = arguments[0]
    if first.startswith("-"):
        return first not in (*HELP, "--json")
    return first not in COMMANDS and (Path(first).suffix != "" or Path(first).exists())


def _fail(sentence: str, as_json: bool, code: int) -> int:
    sentence = " ".join(sentence.split())
    if as_json:
        print(json.dumps({"error": sentence}))
    print(f"filoplume: {sentence}", file=sys.stderr)
    return code
