"""Engines: what computes the forces and the motion of filaments."""
