"""What many tests ask of the same videos or tables, found once."""

import pickle
from dataclasses import replace
from functools import wraps

from airborne.calibration import from_sources
from airborne.calibration.initial import values
from airborne.io.files import file_digest
from airborne.run import mix_ups, whole_run
from airborne.sync import silhouettes


def remember_foregrounds(monkeypatch) -> None:
    """Let what stands out in a video at a start be found once for all trials that hold this video and camera."""
    find, known = mix_ups._foreground, {}

    @wraps(find)
    def found(recording, source, facts, camera):
        clock, rate = replace(recording.sources[0], path=""), recording.facts[0].image_rate
        seen_by = camera.K.tobytes(), camera.distortion.tobytes(), camera.size, camera.lens
        key = file_digest(source.path), replace(source, path=""), facts, seen_by, clock, rate, recording.start
        if key not in known:
            known[key] = find(recording, source, facts, camera)
        return known[key]

    monkeypatch.setattr(mix_ups, "_foreground", found)


def remember_silhouettes(monkeypatch) -> None:
    """Let what moves in a video be segmented once for all trials that hold this video and camera."""
    segment, known = silhouettes.silhouettes_of, {}

    @wraps(segment)
    def segmented(source, camera, on_image=lambda: None):
        place = camera.camera_from_world.as_matrix().tobytes()
        seen_by = camera.name, camera.K.tobytes(), camera.distortion.tobytes(), camera.size, camera.lens, place
        key = file_digest(source.path), replace(source, path=""), seen_by
        if key not in known:
            known[key] = segment(source, camera, on_image)
        else:
            for _ in known[key].time_s:
                on_image()
        return known[key]

    monkeypatch.setattr(silhouettes, "silhouettes_of", segmented)


def remember_calibration(monkeypatch) -> None:
    """Let lenses and initial cameras be found, and cameras adjusted, once for all that do it from the same numbers."""
    for module, name in (
        (values, "choose_lens"),
        (values, "initial_rig_from_points"),
        (values, "initial_rig_from_wand"),
        (from_sources, "adjust"),
    ):
        monkeypatch.setattr(module, name, _remembered(getattr(module, name)))


def _remembered(function):
    known = {}

    @wraps(function)
    def remember(*args, progress=None, **options):
        key = pickle.dumps((args, options))
        if key not in known:
            known[key] = function(*args, progress=progress, **options) if progress else function(*args, **options)
        return known[key]

    return remember


def remember_skins(monkeypatch) -> None:
    """Let the skin of one person, found in the same poses in the same images, be fitted once, which takes a second."""
    fit, known = whole_run.fit_skin, {}

    @wraps(fit)
    def fitted(model, found):
        key = tuple(
            (pose.world_from_root.as_matrix().tobytes(), pose.joint_angles.tobytes(), frames.views[0].rgb.tobytes())
            for frames, pose in found
        )
        if key not in known:
            known[key] = fit(model, found)
        return known[key]

    monkeypatch.setattr(whole_run, "fit_skin", fitted)
