"""A person's own body: in come a few frames and a preset, out come lengths, girths, clothes and colours."""
