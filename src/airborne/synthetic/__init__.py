"""Synthetic recordings with truth: in comes a `Scene`, out come its frames or a whole trial; knows no tracker."""

from airborne.synthetic.aerial import Takeoff, fly_articulated
from airborne.synthetic.flight import Flight, Launch, Mass, fly, mass_of
from airborne.synthetic.light import Ambient, Spot
from airborne.synthetic.pictures import frames
from airborne.synthetic.scene import Scene, thrown_cross
from airborne.synthetic.somersault import Ranges, half_twist, ranges, somersault
from airborne.synthetic.surroundings import gym
from airborne.synthetic.writing import write_somersault, write_thrown_cross, write_trial

__all__ = [
    "Ambient",
    "Flight",
    "Launch",
    "Mass",
    "Ranges",
    "Scene",
    "Spot",
    "Takeoff",
    "fly",
    "fly_articulated",
    "frames",
    "gym",
    "half_twist",
    "mass_of",
    "ranges",
    "somersault",
    "thrown_cross",
    "write_somersault",
    "write_thrown_cross",
    "write_trial",
]
