"""Files of numbers and text: bytes in, checked values out, and back; knows no noun of the field."""
