"""The rigid-body paper made anew: its somersaults, curves and sensitivities beside better methods."""
