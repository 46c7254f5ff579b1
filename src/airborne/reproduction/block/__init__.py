"""The block-jump paper made anew: its sequences, methods and Table I beside better methods."""
