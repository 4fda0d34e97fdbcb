"""Descriptions of filaments: their types, shapes, equilibrium and places on them, before there is a System."""
