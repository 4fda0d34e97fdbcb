"""Straight filaments side by side."""

from openmm_cylchain import Filaments
from support.equilibrium_cases import CASES
from support.solvent import TEMPERATURE, VISCOSITY


def straight_filaments(engine, chains=1, segments=2, kind=CASES["freely-jointed"].type, **options):
    """Filaments along x, 1 um from each other."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for chain in range(chains):
        filaments.add_straight(kind, segments, [0, 1000 * chain, 0], [1, 0, 0], **options)
    return filaments
