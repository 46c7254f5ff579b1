"""The block-jump paper reproduced: its sequences, methods and Table I beside better methods."""
