"""What many tests ask of the same videos, found once."""

from dataclasses import replace
from functools import wraps

from airborne.io.files import file_digest
from airborne.run import mix_ups, whole_run


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
