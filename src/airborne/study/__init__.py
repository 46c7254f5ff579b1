"""The runs of a batch → curves on one time, differences between conditions with intervals, tests, figures, a text."""
