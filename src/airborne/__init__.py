"""Airborne measures bodies in flight from ordinary multi-camera colour video.

A trial is one recording: a TOML file beside its videos, or a `Trial` made in Python. Tracking it leaves a `Run` in
a folder; everything else starts from that:

    import airborne as ab

    trial = ab.read_trial("trial.toml")
    run = ab.track(trial, "results", progress=True)   # later: run = ab.read_run("results")

    run.joints["position"].sel(joint="knee_left", space="z")   # xarray: time in seconds, units in attrs, NaN where lost
    run.joints["position_sd"]                                   # the standard deviation of x is x_sd
    run.angles, run.flight, run.jumps                           # angles, momentum; jumps of players
    run.root, run.motion, run.players                           # the root's pose; plain arrays with full covariance
    run.summary, run.body, run.rig, run.folder
    run.plot()                                                  # curves with bands of two standard deviations

    ab.evaluate(run, "truth.csv")["truth"].describe()
    ab.smooth(run, "butterworth", cutoff_hz=6).tables["joints"]
    ab.export_run(run, "c3d", "trc")

Before tracking:

    rig = ab.calibrate("sources.toml").rig                      # or control points: (..., sizes=(1920, 1080))
    rig["left"].px_from_world(points)                           # a Rig's Camera: (..., 3) [m] -> (..., 2) [px]
    ab.write_rig("calib.toml", rig); ab.read_rig("calib.toml")
    ab.fit_body(trial, "person.toml")

To practise, with truth:

    ab.example_trial("thrown_cross")                            # the bundled trial
    ab.synthesise("somersault", "practice")                     # or "cross", "block"

Lengths are in metres, times in seconds, angles in radians unless a name or `attrs["units"]` says otherwise; the world's
z points up; pixel (0, 0) is the centre of the top-left pixel. What a user can correct raises an `AirborneError`, which
says in one line what was found, what was expected and what to do.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airborne.cameras import Camera, Rig, read_rig, write_rig
    from airborne.errors import AirborneError
    from airborne.interface import (
        calibrate,
        evaluate,
        export_run,
        fit_body,
        read_run,
        read_trial,
        smooth,
        synthesise,
        track,
    )
    from airborne.run.result import Run
    from airborne.trial.examples import example_trial
    from airborne.trial.file import Trial

__version__ = "0.1.0"
__all__ = [
    "AirborneError",
    "Camera",
    "Rig",
    "Run",
    "Trial",
    "calibrate",
    "evaluate",
    "example_trial",
    "export_run",
    "fit_body",
    "read_rig",
    "read_run",
    "read_trial",
    "smooth",
    "synthesise",
    "track",
    "write_rig",
]

_ROOMS = {
    "airborne.cameras": ("Camera", "Rig", "read_rig", "write_rig"),
    "airborne.errors": ("AirborneError",),
    "airborne.run.result": ("Run",),
    "airborne.trial.examples": ("example_trial",),
    "airborne.trial.file": ("Trial",),
}  # of each name, where it is; the others are in airborne.interface


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used, so that `import airborne` is quick."""
    if name not in __all__:
        raise AttributeError(f"module 'airborne' has no attribute '{name}'")
    room = next((room for room, names in _ROOMS.items() if name in names), "airborne.interface")
    value = globals()[name] = getattr(import_module(room), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
