"""Quantities with and without units, as numbers and as text."""
