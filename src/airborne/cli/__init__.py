"""The command line: thin, one function a command."""

from __future__ import annotations

import signal
import sys
from functools import cache
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

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
from airborne.cli.fit_body import fit_body_command
from airborne.cli.machine import bench_command, warm_command
from airborne.cli.smooth import smooth_command
from airborne.cli.studio import studio_command
from airborne.cli.sync import sync_command
from airborne.errors import STOPPED, UNDECIDED, AirborneError, UndecidedError
from airborne.io.environment import set_up_libraries
from airborne.io.writing import describe_path_error

_UsageError: Any = typer.BadParameter.__bases__[0]  # wherever this version of typer keeps it
_STEPS = {  # in the order of the work
    "Begin": {"demo": track.demo_command, "studio": studio_command},
    "Cameras": {"calibrate": calibrate_command, "sync": sync_command, "convert": convert_command},
    "First pose": {
        "check": check_command,
        "find": find_command,
        "frame": frame_command,
        "fit-body": fit_body_command,
    },
    "Track": {"track": track.track_command, "new": new_command, "batch": batch_command},
    "Results": {
        "smooth": smooth_command,
        "evaluate": results.evaluate_command,
        "compare": compare_command,
        "export": export_command,
        "film": film_command,
    },
    "This machine": {"bench": bench_command, "warm": warm_command},
}
_SYNTH = {
    "cross": synth.synth_cross_command,
    "somersault": synth.synth_somersault_command,
    "block": synth.synth_block_command,
}
_REPRODUCE = {"rigid": reproduce.reproduce_rigid_command, "blockjump": reproduce.reproduce_blockjump_command}


class _Steps(TyperGroup):
    """The commands in the help under the steps of the work, and last the groups of commands."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each step."""
        groups = {name: None for name in self.commands if not any(name in step for step in _STEPS.values())}
        width = max(map(len, self.commands))
        for heading, names in {**_STEPS, "Research": groups}.items():
            with formatter.section(heading):
                formatter.write_dl(
                    [(f"{name:{width}}", self.commands[name].get_short_help_str(1000)) for name in names]
                )


def _group(commands: dict, text: str, **options: Any) -> typer.Typer:
    group = typer.Typer(no_args_is_help=True, help=text, rich_markup_mode=None, **options)  # [start] is no markup
    for name, command in commands.items():
        group.command(name, short_help=(command.__doc__ or "").partition("\n")[0])(command)  # whole, however long
    return group


app = _group(
    {name: command for step in _STEPS.values() for name, command in step.items()},
    "Measure athletes in flight from ordinary multi-camera colour video.",
    cls=_Steps,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(_group(_SYNTH, "Write a synthetic trial with its truth."), name="synth")
app.add_typer(_group(_REPRODUCE, "Repeat a paper's experiment: its table beside ours."), name="reproduce")


@cache
def command_tree() -> Any:
    """Return the commands as Typer runs them, made once: that takes as long as many a command does."""
    return typer.main.get_command(app)


def main() -> None:
    """Run the command line; a user's error is one line on stderr and exit code 2."""
    set_up_libraries()
    show_notes()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a scheduler's stop is as orderly as Ctrl-C
    try:
        code = command_tree()(standalone_mode=False)
        if code == STOPPED:  # typer's answer to Ctrl-C
            stop()
        sys.exit(code)
    except _UsageError as error:
        _refuse_usage(error)
    except (KeyboardInterrupt, typer.Abort):
        stop()
    except ImportError as error:  # some libraries in C turn a stop while they are loaded into one
        if not isinstance(error.__cause__ or error.__context__, KeyboardInterrupt):
            raise
        stop()
    except UndecidedError as error:
        refuse(str(error), code=UNDECIDED)
    except AirborneError as error:
        refuse(str(error))
    except OSError as error:
        refuse(describe_path_error(error, "give another folder with -o"))


def _refuse_usage(error: Any) -> NoReturn:
    """Say which word of the command line is wrong, and what is meant by it or missing; exit with code 2."""
    message, context = error.format_message(), getattr(error, "ctx", None)
    if "Usage:" in message or not message:  # a command without arguments: its help
        print(message, end="")
        sys.exit(2)
    message = message.replace("Value error, ", "").replace("Input should be", "expected a number")
    if possible := getattr(error, "possibilities", None):
        message = f"{error.message}. Did you mean {' or '.join(possible)}?"
    elif message.startswith("Missing") and (meaning := getattr(error.param, "help", None)):
        message = f"{message.rstrip('.')}: {meaning}"
    text, command = " ".join(message.split()).rstrip("."), context.command_path if context else "airborne"
    refuse(f"{text} See {command} --help" if text.endswith("?") else f"{text}; see {command} --help")


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        print(__version__)
        raise typer.Exit
