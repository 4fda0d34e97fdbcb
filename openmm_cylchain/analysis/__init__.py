"""Analysis of trajectories of filaments with mdtraj."""

from .trajectories import *  # noqa: F403
