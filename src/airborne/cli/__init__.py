"""The command line: thin, one function a command."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from airborne import __version__
from airborne.cli import reproduce, results, synth, track
from airborne.cli.calibrate import calibrate
from airborne.cli.console import STOPPED, refuse, stopped
from airborne.cli.convert import convert
from airborne.cli.export import export
from airborne.cli.smooth import smooth
from airborne.cli.sync import sync
from airborne.errors import AirborneError

_UsageError: Any = typer.BadParameter.__bases__[0]  # wherever this version of typer keeps it
_COMMANDS = {
    "demo": track.demo,
    "track": track.track,
    "calibrate": calibrate,
    "sync": sync,
    "convert": convert,
    "fit-body": track.fit_body,
    "smooth": smooth,
    "evaluate": results.evaluate,
    "export": export,
    "bench": track.bench,
}
_SYNTH = {"cross": synth.synth_cross, "somersault": synth.synth_somersault, "block": synth.synth_block}
_REPRODUCE = {"rigid": reproduce.reproduce_rigid, "blockjump": reproduce.reproduce_blockjump}


def _group(commands: dict, text: str, **options: Any) -> typer.Typer:
    group = typer.Typer(no_args_is_help=True, help=text, rich_markup_mode=None, **options)  # [start] is no markup
    for name, command in commands.items():
        group.command(name)(command)
    return group


app = _group(
    _COMMANDS,
    "Measure athletes in flight from ordinary multi-camera colour video.",
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(_group(_SYNTH, "Write a synthetic trial with its truth."), name="synth")
app.add_typer(_group(_REPRODUCE, "Make a paper's experiment anew: its table beside ours."), name="reproduce")


def main() -> None:
    """Run the command line; a user's error is one line on stderr and exit code 2."""
    try:
        code = app(standalone_mode=False)
        if code == STOPPED:  # typer's answer to Ctrl-C
            stopped()
        sys.exit(code)
    except _UsageError as error:
        said, context = error.format_message(), getattr(error, "ctx", None)
        if "Usage:" in said or not said:  # a command without arguments: its help
            print(said, end="")
            sys.exit(2)
        said = said.replace("Value error, ", "").replace("Input should be", "expected a number")
        refuse(f"{' '.join(said.split()).rstrip('.')}; see {context.command_path if context else 'airborne'} --help")
    except (KeyboardInterrupt, typer.Abort):
        stopped()
    except AirborneError as error:
        refuse(str(error))
    except OSError as error:
        refuse(_said_of_path(error))


def _said_of_path(error: OSError) -> str:
    """Say what stands in the way at the path that an error is about."""
    path = Path(str(error.filename or "a file"))
    file = next((place for place in (path, *path.parents) if place.is_file()), path)
    match error:
        case FileExistsError() | NotADirectoryError():
            return f"{file} is a file; give a folder"
        case IsADirectoryError():
            return f"{path} is a folder; give a file's name"
        case FileNotFoundError() if not path.parent.exists():
            return f"{path}: there is no folder {path.parent}; make it, or give another path"
    return f"{path}: {error.strerror or error}; give a path that can be read or written"


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        print(__version__)
        raise typer.Exit
