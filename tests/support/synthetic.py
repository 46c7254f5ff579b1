"""Small scenes, quick to draw."""

from dataclasses import replace

from airborne.cameras import Rig
from airborne.synthetic import thrown_cross


def small_scene(preset="half-twist", *, scale=4, **changes):
    """Return a preset's scene with images smaller by `scale`, four pictures long."""
    scene = thrown_cross(preset, seed=3, clutter=6)
    small = Rig(
        tuple(
            camera.resample(
                scale=(scale, scale),
                offset=((scale - 1) / 2, (scale - 1) / 2),
                size=(camera.size[0] // scale, camera.size[1] // scale),
            )
            for camera in scene.rig
        )
    )
    return replace(scene, **{"rig": small, "n_pictures": 4, **changes})
