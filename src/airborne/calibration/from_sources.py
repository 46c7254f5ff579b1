"""All sources in one adjustment: evidence, time, world frame, and how well what was left out is predicted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.bundle import Adjusted, Freedom, Lags, Source, adjust
from airborne.calibration.cross_validation import held_out
from airborne.calibration.initial.chaining import board_source, boards_in
from airborne.calibration.initial.resection import Mending, disagreeing, mend
from airborne.calibration.initial.values import Inputs, Told, read_inputs
from airborne.calibration.sources.files import Sources
from airborne.calibration.sources.person import given_prior, person_source
from airborne.calibration.sources.scene_points import scene_source
from airborne.calibration.sources.wand import wand_source
from airborne.calibration.world_frame.choice import Framed, framed
from airborne.cameras import Rig

Array = NDArray[np.floating]

LONGEST_GAP_S = 0.26  # between pictures that say how the board moves
LOOSER = 0.75  # of the noise: lags are kept where they leave less than this
FEWEST_MOMENTS = 10
LAG_SD = 0.5  # of the time between pictures


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibrated:
    """Cameras from all sources, and how far to trust them."""

    inputs: Inputs
    adjusted: Adjusted  # in the wanted world
    world: str  # how the world's frame was found, in words
    held_out_px: Mapping[str, Array]  # by source, distances of what was left out of the fit [px]
    lag_s: Mapping[str, Array]  # by camera, of its pictures against the others' mean; empty where all are in time
    mended: tuple[Mending, ...]
    notes: tuple[str, ...]

    @property
    def rig(self) -> Rig:
        """The cameras."""
        return self.adjusted.rig


def calibrate_from(sources: Sources, told: Told) -> Calibrated:
    """Read all sources and adjust the cameras to all of them at once; raises an AirborneError in one line.

    told: what is being done, how much of it is done, and of how much.
    """
    inputs = read_inputs(sources, told)
    rig, mended = _mended(inputs)
    freedom = inputs.freedom
    first = _adjusted(inputs, rig, freedom, None, told)
    adjusted, lag_sd_s = first, _lag_sd_s(inputs)
    if lag_sd_s is not None:
        looser = _adjusted(inputs, first.rig, freedom, lag_sd_s, told)
        row = [source.name for source in looser.sources].index("board")
        is_better = looser.noise_px[row] < LOOSER * first.noise_px[row]
        asked = sources.board is not None and sources.board.sync == "loose"
        adjusted, lag_sd_s = (looser, lag_sd_s) if is_better or asked else (first, None)
    elif inputs.wand is not None or (inputs.detections is not None and first.prior is None):
        adjusted = _adjusted(inputs, first.rig, freedom, None, told)  # triangulated anew by better cameras
    place = framed(inputs, adjusted, [m.camera.name for m in mended])
    final = adjusted if place.stays else _refreshed(adjusted, place, told)
    missed = held_out(final, lambda done, n: told("leaving out and predicting", done, n))
    lags = _lags(final) if lag_sd_s is not None else {}
    return Calibrated(
        inputs=inputs,
        adjusted=final,
        world=place.said,
        held_out_px=missed,
        lag_s=lags,
        mended=mended,
        notes=(*inputs.notes, *_said_of_lags(lags)),
    )


def _mended(inputs: Inputs) -> tuple[Rig, tuple[Mending, ...]]:
    """Place cameras anew first that a person's detections say are elsewhere than the calibration at the start."""
    if inputs.detections is None or inputs.given is None:
        return inputs.rig, ()
    wrong = disagreeing(inputs.rig, inputs.detections)
    if not wrong:
        return inputs.rig, ()
    return mend(inputs.rig, inputs.detections, [m.camera.name for m in wrong])[0], wrong


def _adjusted(inputs: Inputs, rig: Rig, freedom: Mapping[str, Freedom], lag_sd_s: float | None, told: Told) -> Adjusted:
    evidence = _evidence(inputs, rig, lag_sd_s)
    prior = None
    if inputs.given is not None and inputs.sources.given == ["detections"]:
        prior = given_prior(
            rig, [c.name for c, old in zip(rig, inputs.rig, strict=True) if c is old], evidence[0].points
        )
    return adjust(rig, evidence, freedom, prior=prior, progress=lambda step, _: told("adjusting", step, None))


def _evidence(inputs: Inputs, rig: Rig, lag_sd_s: float | None) -> list[Source]:
    """Return every source, its unknowns beginning where the rig sees them."""
    found = [scene_source(rig.names, points, name=name) for name, points in inputs.points.items()]
    if inputs.seen is not None:
        views = inputs.seen.views
        source = board_source(
            views, boards_in(rig.select(views.cameras), views), rows=[rig.names.index(name) for name in views.cameras]
        )
        time_s = inputs.seen.time_s
        if lag_sd_s is not None and time_s is not None:
            group = source.camera * views.n_moments + source.moments
            source = replace(source, lags=Lags(group=group, time_s=time_s, sd_s=lag_sd_s))
        found.append(source)
    for name, views in inputs.alone.items():
        places = boards_in(rig.select([name]), views)
        found.append(board_source(views, places, name=f"lens of {name}", rows=[rig.names.index(name)]))
    if inputs.wand is not None:
        found.append(wand_source(rig, inputs.wand))
    if inputs.detections is not None:
        found.append(person_source(rig, inputs.detections))
    return found


def _lag_sd_s(inputs: Inputs) -> float | None:
    """Return how far pictures may lag behind others, or None where they are taken to be of the same instant."""
    seen, table = inputs.seen, inputs.sources.board
    if seen is None or table is None or table.sync == "exact" or seen.time_s is None or len(seen.views.cameras) < 2:
        return None
    gap_s = float(np.median(np.diff(seen.time_s))) if len(seen.time_s) > 1 else np.inf
    is_dense = gap_s <= LONGEST_GAP_S and (seen.views.n_corners > 0).any(axis=0).sum() >= FEWEST_MOMENTS
    return LAG_SD * gap_s if is_dense else None


def _refreshed(adjusted: Adjusted, place: Framed, told: Told) -> Adjusted:
    """Move everything to the world that is wanted, and find the standard deviations there."""
    rig, sources = adjusted.moved(place.new_from_old, place.scale)
    if place.held_moment is not None:
        held = [
            replace(s, is_held=np.arange(s.n_moments) == place.held_moment) if s.name == "board" else s for s in sources
        ]
        sources = tuple(held)
    freedom = dict(adjusted.freedom)
    if place.held_camera is not None:
        freedom[place.held_camera] = replace(freedom[place.held_camera], place=False)
    return adjust(rig, sources, freedom, progress=lambda step, _: told("adjusting", step, None))


def _lags(adjusted: Adjusted) -> dict[str, Array]:
    """Return each camera's lags, one a picture of the moving board."""
    row = [source.name for source in adjusted.sources].index("board")
    source, lag_s = adjusted.sources[row], adjusted.lag_s[row]
    found = {}
    for i, name in enumerate(adjusted.rig.names):
        _, first = np.unique(source.moments[source.camera == i], return_index=True)
        found[name] = lag_s[source.camera == i][first]
    return found


def _said_of_lags(lags: Mapping[str, Array]) -> tuple[str, ...]:
    if not lags:
        return ()
    said = ", ".join(f"{name} {np.median(lag_s) * 1e3:+.0f} ms" for name, lag_s in lags.items() if len(lag_s))
    return (
        "the cameras do not look at the same instant; each picture of the moving board has its own time now "
        f"(median against the others: {said})",
    )
