"""One file a calibration format, each reading and writing what the format holds.

In come a file's text and what the file does not say about itself (`Given`); out goes a `Rig`. Out of a `Rig` comes a
text, with sentences on what the format cannot hold. Which file is which is told in `cameras/files.py`.
"""

from airborne.cameras.formats.options import FileOptions, PixelConvention, Size, Unit

__all__ = ["FileOptions", "PixelConvention", "Size", "Unit"]
