"""The rigid-body paper reproduced: its somersaults, curves and sensitivities beside better methods."""
