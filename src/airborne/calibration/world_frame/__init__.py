"""The world frame of a calibration: which source defines it, and how rigs are aligned with it."""
