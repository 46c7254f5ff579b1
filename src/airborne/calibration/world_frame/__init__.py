"""The world's frame of a calibration: which source decides it, and how rigs are brought into it."""
