"""Synthetic recordings with truth: in comes a `Scene`, out come its frames or a whole trial; knows no tracker."""

from airborne.synthetic.block.pictures import block_frames
from airborne.synthetic.block.scene import DIFFICULTIES, BlockScene, Difficulty, block_scene
from airborne.synthetic.block.truth import jump_truth, noisy_starts, torso_input, true_joints
from airborne.synthetic.block.writing import write_block
from airborne.synthetic.flight.articulated import Takeoff, fly_articulated
from airborne.synthetic.flight.rigid import Launch, MassProperties, SampledFlight, fly, mass_properties
from airborne.synthetic.flight.skill import PoseRanges, half_twist
from airborne.synthetic.flight.somersault import somersault_scene
from airborne.synthetic.throw.light import Ambient, Spot
from airborne.synthetic.throw.pictures import scene_frames
from airborne.synthetic.throw.scene import Scene, cross_scene
from airborne.synthetic.throw.surroundings import gym
from airborne.synthetic.throw.writing import write_somersault, write_thrown_cross, write_trial

__all__ = [
    "DIFFICULTIES",
    "Ambient",
    "BlockScene",
    "Difficulty",
    "Launch",
    "MassProperties",
    "PoseRanges",
    "SampledFlight",
    "Scene",
    "Spot",
    "Takeoff",
    "block_frames",
    "block_scene",
    "cross_scene",
    "fly",
    "fly_articulated",
    "gym",
    "half_twist",
    "jump_truth",
    "mass_properties",
    "noisy_starts",
    "scene_frames",
    "somersault_scene",
    "torso_input",
    "true_joints",
    "write_block",
    "write_somersault",
    "write_thrown_cross",
    "write_trial",
]
