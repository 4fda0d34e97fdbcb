"""Bead-spring chains: the model of Panja, Barkema and van Leeuwen, its exact equilibrium and its modes."""
