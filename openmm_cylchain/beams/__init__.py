"""Chains of elements that bend inside: their curve, energy and equilibrium."""
