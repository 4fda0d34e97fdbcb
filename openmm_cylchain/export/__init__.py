"""Runs as files for other programs: Simularium, OVITO and VMD."""
