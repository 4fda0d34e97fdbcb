"""Configurations of Cytosim as configurations of runs: the command ``import``."""
