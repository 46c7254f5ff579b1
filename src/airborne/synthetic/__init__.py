"""Synthetic recordings with truth: in comes a `Scene`, out come its frames or a whole trial; knows no tracker."""

from airborne.synthetic.block.pictures import frames_of
from airborne.synthetic.block.scene import DIFFICULTIES, BlockScene, Difficulty, block_scene, paper_sequences
from airborne.synthetic.block.truth import joints_of, jump_facts, starts_of, torso_input
from airborne.synthetic.block.writing import write_block
from airborne.synthetic.flight.articulated import Takeoff, fly_articulated
from airborne.synthetic.flight.rigid import Flight, Launch, Mass, fly, mass_of
from airborne.synthetic.flight.somersault import Ranges, half_twist, ranges, somersault
from airborne.synthetic.throw.light import Ambient, Spot
from airborne.synthetic.throw.pictures import frames
from airborne.synthetic.throw.scene import Scene, thrown_cross
from airborne.synthetic.throw.surroundings import gym
from airborne.synthetic.throw.writing import write_somersault, write_thrown_cross, write_trial

__all__ = [
    "DIFFICULTIES",
    "Ambient",
    "BlockScene",
    "Difficulty",
    "Flight",
    "Launch",
    "Mass",
    "Ranges",
    "Scene",
    "Spot",
    "Takeoff",
    "block_scene",
    "fly",
    "fly_articulated",
    "frames",
    "frames_of",
    "gym",
    "half_twist",
    "joints_of",
    "jump_facts",
    "mass_of",
    "paper_sequences",
    "ranges",
    "somersault",
    "starts_of",
    "thrown_cross",
    "torso_input",
    "write_block",
    "write_somersault",
    "write_thrown_cross",
    "write_trial",
]
