"""The command line: thin, one function a command."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from airborne import __version__
from airborne.cli import reproduce, results, synth, track
from airborne.cli.batch import batch_command, new_command
from airborne.cli.calibrate import calibrate_command
from airborne.cli.check import check_command
from airborne.cli.compare import compare_command
from airborne.cli.console import refuse, show_notes, stop
from airborne.cli.convert import convert_command
from airborne.cli.export import export_command
from airborne.cli.film import film_command
from airborne.cli.find import find_command, frame_command
from airborne.cli.smooth import smooth_command
from airborne.cli.studio import studio_command
from airborne.cli.sync import sync_command
from airborne.errors import STOPPED, UNDECIDED, AirborneError, UndecidedError

_MOST_PIXELS = "150000000"  # of a picture that OpenCV decodes, as of a video's; a file may declare any number
_UsageError: Any = typer.BadParameter.__bases__[0]  # wherever this version of typer keeps it
_COMMANDS = {
    "demo": track.demo_command,
    "studio": studio_command,
    "check": check_command,
    "find": find_command,
    "frame": frame_command,
    "track": track.track_command,
    "new": new_command,
    "batch": batch_command,
    "compare": compare_command,
    "calibrate": calibrate_command,
    "sync": sync_command,
    "convert": convert_command,
    "fit-body": track.fit_body_command,
    "smooth": smooth_command,
    "evaluate": results.evaluate_command,
    "export": export_command,
    "film": film_command,
    "bench": track.bench_command,
    "warm": track.warm_command,
}
_SYNTH = {
    "cross": synth.synth_cross_command,
    "somersault": synth.synth_somersault_command,
    "block": synth.synth_block_command,
}
_REPRODUCE = {"rigid": reproduce.reproduce_rigid_command, "blockjump": reproduce.reproduce_blockjump_command}


def _group(commands: dict, text: str, **options: Any) -> typer.Typer:
    group = typer.Typer(no_args_is_help=True, help=text, rich_markup_mode=None, **options)  # [start] is no markup
    for name, command in commands.items():
        group.command(name, short_help=(command.__doc__ or "").partition("\n")[0])(command)  # whole, however long
    return group


app = _group(
    _COMMANDS,
    "Measure athletes in flight from ordinary multi-camera colour video.",
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(_group(_SYNTH, "Write a synthetic trial with its truth."), name="synth")
app.add_typer(_group(_REPRODUCE, "Repeat a paper's experiment: its table beside ours."), name="reproduce")


def main() -> None:
    """Run the command line; a user's error is one line on stderr and exit code 2."""
    os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", _MOST_PIXELS)  # read when OpenCV is loaded
    show_notes()
    try:
        code = app(standalone_mode=False)
        if code == STOPPED:  # typer's answer to Ctrl-C
            stop()
        sys.exit(code)
    except _UsageError as error:
        message, context = error.format_message(), getattr(error, "ctx", None)
        if "Usage:" in message or not message:  # a command without arguments: its help
            print(message, end="")
            sys.exit(2)
        message = message.replace("Value error, ", "").replace("Input should be", "expected a number")
        command = context.command_path if context else "airborne"
        refuse(f"{' '.join(message.split()).rstrip('.?')}; see {command} --help")
    except (KeyboardInterrupt, typer.Abort):
        stop()
    except UndecidedError as error:
        refuse(str(error), code=UNDECIDED)
    except AirborneError as error:
        refuse(str(error))
    except OSError as error:
        refuse(_describe_path_error(error))


def _describe_path_error(error: OSError) -> str:
    """Describe what is wrong with the path of a file error."""
    path = Path(str(error.filename or "a file"))
    if error.errno == errno.ENAMETOOLONG:
        return f"{str(path)[:60]}...: the name is too long; give a shorter one"
    file = next((each for each in (path, *path.parents) if each.is_file()), path)
    match error:
        case FileExistsError() | NotADirectoryError():
            return f"{file} is a file; give a folder"
        case IsADirectoryError():
            return f"{path} is a folder; give a file's name"
        case FileNotFoundError() if not path.parent.exists():
            return f"{path}: there is no folder {path.parent}; make it, or give another path"
        case PermissionError() if path.suffix == ".part" or not path.exists():  # .part: a file that is being written
            return f"{path.parent} cannot be written ({error.strerror}); give another folder with -o"
    return f"{path}: {error.strerror or error}; give a path that can be read or written"


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        print(__version__)
        raise typer.Exit
