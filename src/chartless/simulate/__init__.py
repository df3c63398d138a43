"""Frames that a camera would take of a scene, as arrays and as files."""

from chartless.simulate.camera import simulate_frames as simulate_frames
