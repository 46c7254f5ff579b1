"""One file a calibration format, each reading and writing what the format holds.

A reader takes a file's text and what it does not say about itself (`FileOptions`) and returns a `Rig`. A writer takes a
`Rig` and returns a text, with phrases on what the format cannot hold. `cameras/files.py` recognises the format.
"""

from airborne.cameras.formats.options import FileOptions, PixelConvention, Unit

__all__ = ["FileOptions", "PixelConvention", "Unit"]
