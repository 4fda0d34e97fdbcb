"""What only the portable integrator has: a force group of its own and vectors that pass through the positions."""

import numpy as np
import openmm
import pytest

from openmm_cylchain import InputError
from support.contexts import new_context, positions_of
from support.filaments_and_beads import STEP, actin_filaments, filaments_and_beads, integrator_of_both


def test_force_in_the_engines_group_is_refused():
    filaments, system, positions = filaments_and_beads("portable")
    integrator = integrator_of_both(filaments, system)
    late = openmm.CustomExternalForce("x")
    late.setForceGroup(31)
    system.addForce(late)
    context = new_context(system, positions, integrator)  # noqa: F841 (an integrator does not keep its Context alive)
    with pytest.raises(InputError, match="force group 31"):
        integrator.step(1)


def test_engine_takes_a_free_force_group_or_says_that_there_is_none():
    filaments = actin_filaments("portable", (2,))
    _, system, _ = filaments.build()
    for group in range(1, 32):
        force = openmm.CustomExternalForce("0")
        force.setForceGroup(group)
        system.addForce(force)
    with pytest.raises(InputError, match="all 32 are in use"):
        filaments.create_integrator(system, STEP)
    names = [force.getForceGroup() for force in system.getForces()]
    system.removeForce(names.index(13))
    filaments.create_integrator(system, STEP)
    assert system.getForce(system.getNumForces() - 1).getForceGroup() == 13


def test_later_integrators_leave_earlier_contexts_alone():
    """Integrators with other friction, created later, change nothing for Contexts that exist."""
    filaments, system, positions = filaments_and_beads("portable")
    integrator = integrator_of_both(filaments, system, random_seed=1)
    forces = system.getNumForces()
    context = new_context(system, positions, integrator)
    integrator.step(5)
    expected = positions_of(context)

    integrator = integrator_of_both(filaments, system, random_seed=1)
    assert system.getNumForces() == forces
    context = new_context(system, positions, integrator)
    others = [
        filaments.create_integrator(system, STEP, particle_friction=friction, random_seed=1)
        for friction in (1e4, 1e5, 1e6)
    ]
    assert system.getNumForces() == forces + 3
    integrator.step(5)
    assert np.array_equal(positions_of(context), expected)
    context = new_context(system, positions, others[0])
    others[0].step(5)
    moved = positions_of(context)
    assert np.array_equal(moved[3:], expected[3:])
    assert not np.allclose(moved[0], expected[0])


def test_system_that_became_periodic_later_is_refused():
    filaments = actin_filaments("portable", (2,))
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, STEP)
    nonbonded = openmm.NonbondedForce()
    nonbonded.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
    for _ in range(system.getNumParticles()):
        nonbonded.addParticle(0, 1, 0)
    system.addForce(nonbonded)
    context = new_context(system, positions, integrator)  # noqa: F841 (an integrator does not keep its Context alive)
    with pytest.raises(InputError, match="periodic"):
        integrator.step(1)
