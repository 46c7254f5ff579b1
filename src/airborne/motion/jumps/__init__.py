"""Jumps of players: leg tracks come in; jump heights by several definitions and events go out."""
