"""The sources of a calibration: points, boards, wands, courts, people; read, and made observations."""
