"""Filaments in an OpenMM System: building it, its integrator, periodic boxes, and the check of a step."""
