"""One chain of 10 000 base pairs, whose steps are taken piece by piece: its energies, and its motion."""

import numpy as np
import pytest

from openmm_cylchain import DSDNA_BASE_PAIRS, Filaments, theory
from support.contexts import new_context, positions_of

KIND, ROOM, VISCOSITY = DSDNA_BASE_PAIRS, 296.15, 602.0
BONDS = 9999
STEP = 1e4 * KIND.time_unit
FRAMES, APART = 20, 20


@pytest.fixture(scope="module")
def chain():
    filaments = Filaments(VISCOSITY, ROOM, engine="compiled")
    filaments.add_equilibrium(KIND, BONDS, seed=5)
    _, system, positions = filaments.build()
    return filaments, system, positions


def context_of(chain, precision):
    filaments, system, positions = chain
    integrator = filaments.create_integrator(
        system, STEP, scheme="implicit", random_seed=2, precision=precision, checks=False
    )
    return new_context(system, positions, integrator)


@pytest.mark.slow
def test_energies_are_exact(chain):
    context = context_of(chain, "automatic")
    integrator = context.getIntegrator()
    energies = np.empty((FRAMES, 2))
    for frame in energies:
        integrator.step(APART)
        bonds = np.diff(positions_of(context), axis=0)
        frame[0] = KIND.stretching_energies(np.linalg.norm(bonds, axis=1)).mean()
        frame[1] = 0.5 * KIND.bending_stiffness * np.mean(np.sum(np.diff(bonds, axis=0) ** 2, axis=1))
    # A chain alone is in single precision only where it is taken piece by piece.
    assert integrator.getNumMixedPrecisionChains() == 1
    assert integrator.getNumDividedSteps() < FRAMES * APART / 100
    # Far from the ends, all bonds are alike.
    exact = [
        energies_of(KIND, 600, ROOM)[200:400].mean()
        for energies_of in (theory.bead_spring_stretching_energies, theory.bead_spring_bending_energies)
    ]
    error = energies.std(axis=0, ddof=1) / np.sqrt(FRAMES)
    assert np.all(error < 0.006 * np.array(exact))
    assert np.all(np.abs(energies.mean(axis=0) - exact) < 0.005 * np.array(exact) + 4.0 * error)


@pytest.mark.parametrize("precision", ["automatic", "double"])
def test_a_step_is_that_of_the_whole_chain(chain, precision):
    """Steps whose forces are recorded are taken whole."""
    context, whole = context_of(chain, precision), context_of(chain, precision)
    whole.getIntegrator().setRecordsTensions(True)
    for _ in range(3):
        before = positions_of(context)
        whole.setPositions(before)
        for one in (context, whole):
            one.getIntegrator().step(1)
        difference = (positions_of(context) - positions_of(whole)) / KIND.bead_spacing
        moved = np.linalg.norm(positions_of(whole) - before, axis=1) / KIND.bead_spacing
        of_bonds = np.linalg.norm(np.diff(difference, axis=0), axis=1)
        # Bonds change by 0.03 at most in the last iteration.
        assert 0.0 < of_bonds.max() < 0.009
        assert np.linalg.norm(difference, axis=1).max() < 0.03
        assert np.sqrt(np.mean(difference**2)) < 1e-3 * np.sqrt(np.mean(moved**2))
