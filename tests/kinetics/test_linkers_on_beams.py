"""Linkers on the curves of beam elements, alone and beside straight segments: equilibrium, motion, tables, restarts."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.spatial.transform import Rotation

from openmm_cylchain import F_ACTIN, MICROTUBULE, Crosslinker, Filaments, FilamentType, Hand, InputError
from openmm_cylchain.beams.equilibrium import draw_beam
from openmm_cylchain.beams.curve import arc_lengths, control_points_of, element_points
from support.contexts import energy_of, forces_of, new_context, positions_of, slopes_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

SECOND = 1e12
PICONEWTON = 0.602214076
# Elements that bend by about half a radian.
SOFT = FilamentType(
    name="SOFT",
    diameter=6.0,
    segment_length=60.0,
    persistence_length=240.0,
    temperature=TEMPERATURE,
    stretching_modulus=500.0,
    friction_length="filament",
    element="beam",
)
ACTIN = replace(F_ACTIN, name="BEAM", segment_length=200.0, extension_relaxation_time=None, element="beam")
HAND = Hand(binding_rate=3e4 / SECOND, reach=60.0, unbinding_rate=2e3 / SECOND)
SPRING = Crosslinker(hands=HAND, stiffness=0.1 * PICONEWTON)
MOTOR = Crosslinker(
    hands=replace(HAND, speed=8e4 / SECOND, stall_force=6.0 * PICONEWTON, unbinding_force=3.0 * PICONEWTON),
    stiffness=0.1 * PICONEWTON,
    rest_length=20.0,
)
ON_SITES = replace(MOTOR, hands=replace(MOTOR.hands[0], site_spacing=8.0))
TRAP = 0.05 * PICONEWTON


def of_copies(copies, seed):
    """Beams of two elements, each tethered by its first node where it is drawn from equilibrium."""
    filaments, generator = Filaments(VISCOSITY, TEMPERATURE, engine="compiled"), np.random.default_rng(seed)
    for copy in range(copies):
        centre = np.array([0.0, 0.0, 1000.0 * copy])
        start = centre + generator.normal(0.0, np.sqrt(KT / TRAP), 3)
        filaments.add_equilibrium(SOFT, 2, seed=seed + copy, start=start)
        filaments.add_tether(copy, 0, point=centre, stiffness=TRAP)
    return filaments


def expected_on_soft_beams(weight, stiffness, rest_length, reach, anchor, shapes=3000, turns=60):
    """Bound over unbound copies, the mean energy of springs and the mean place along the beams, by sums over draws.

    Of many shapes, each is turned and moved with its first node many times.
    """
    generator, per_element = np.random.default_rng(8), 30
    element = SOFT.beam_element(TEMPERATURE, False)
    places = (np.arange(per_element) + 0.5) / per_element
    along = (np.arange(2 * per_element) + 0.5) * 60.0 / per_element
    bound, energies, arc = 0.0, 0.0, 0.0
    for _ in range(shapes):
        drawn = draw_beam(element, 2, KT, generator, np.zeros(3), None, False)
        points = element_points(*drawn, places).reshape(-1, 3)
        turned = np.einsum("rij,pj->rpi", Rotation.random(turns, rng=generator).as_matrix(), points)
        distance = np.linalg.norm(turned + generator.normal(-anchor, np.sqrt(KT / TRAP), (turns, 1, 3)), axis=2)
        energy = 0.5 * stiffness * (distance - rest_length) ** 2
        factor = np.where(distance < reach, np.exp(-energy / KT), 0.0)
        bound += factor.sum()
        energies += (factor * energy).sum()
        arc += (factor * along).sum()
    return weight * bound / (shapes * turns) * 60.0 / per_element, energies / bound, arc / bound


@pytest.mark.parametrize(
    ("rest_length", "step"), [(0.0, 0.2), (25.0, 2.0), pytest.param(25.0, 0.05, marks=pytest.mark.slow)]
)
def test_binding_and_bending_are_in_equilibrium_together(rest_length, step):
    """Anchored hands and soft beams: how many are bound, with what energy, and where along the curve.

    Steps are in units in which a hand unbinds about once, and a beam turns by about a radian.
    """
    copies, stiffness, time = 100, 0.02 * PICONEWTON, 2e7
    hand = Hand(binding_rate=30.0 / time, reach=110.0, unbinding_rate=1.0 / time, strain_share=0.3)
    filaments, anchor = of_copies(copies, 1), np.array([0.0, 30.0, 0.0])
    kind = Crosslinker(hands=hand, stiffness=stiffness, rest_length=rest_length)
    filaments.add_linkers(kind, anchors=anchor + np.array([0.0, 0.0, 1000.0]) * np.arange(copies)[:, None])
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step * time, random_seed=3, checks=False)
    context = new_context(system, positions, integrator)
    interval = max(1, round(1.0 / step))
    integrator.step(8 * interval)
    found = []
    for _ in range(400):
        integrator.step(interval)
        table, pulls = filaments.linkers_in(context), filaments.linker_pulls(context)
        bound = table.bound[:, 1]
        energies = 0.5 * stiffness * (pulls.lengths - rest_length) ** 2
        found.append((bound.mean(), energies.sum() / copies, table.arc_lengths[bound, 1].sum() / copies))
    ratio, energy, along = expected_on_soft_beams(
        hand.rate_per_length / hand.unbinding_rate, stiffness, rest_length, hand.reach, anchor
    )
    share = ratio / (1.0 + ratio)
    assert 0.3 < share < 0.8
    means = np.array(found).reshape(20, -1, 3).mean(axis=1)
    errors = means.std(axis=0, ddof=1) / np.sqrt(len(means))
    print(means.mean(axis=0), errors, share, share * energy, share * along)
    for mean, error, exact in zip(means.mean(axis=0), errors, share * np.array([1.0, energy, along]), strict=True):
        assert 4.0 * error < 0.05 * exact
        assert abs(mean - exact) < 0.01 * exact + 4.0 * error
