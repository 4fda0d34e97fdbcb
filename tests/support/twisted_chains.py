"""Chains with twist in a Context, and averages over them beside exact ones."""

from dataclasses import replace

import numpy as np
import openmm
import pytest

from openmm_cylchain import Filaments, FilamentType, capsule_contact_force
from support.contexts import new_context
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
LENGTH = 5.0
CHAIN = {
    "name": "DNA",
    "diameter": 2.0,
    "segment_length": LENGTH,
    "bending_rigidity": 50.0 * KT,
    "stretching_modulus": 4000.0 * KT,
    "bending_model": "kratky-porod",
}
DNA = FilamentType(torsional_rigidity=100.0 * KT, **CHAIN)
UNTWISTED = FilamentType(**CHAIN)
END = 4.0 * KT
NANOSECOND = 1e3


def in_context(
    filaments,
    step,
    pull=None,
    seed=1,
    platform="CPU",
    contacts=False,
    level=0,
    force=None,
    precision="automatic",
    links=None,
):
    """A Context of filaments, which constant forces pull along z, and a FilamentsInContext.

    Stronger ones hold the last segment along z, where a frame may be. The level is that of the Brownian path.
    """
    _, system, positions = filaments.build()
    if force is not None:
        system.addForce(force)
    if links is not None:
        links.add_to(system)
    if pull is not None:
        force = openmm.CustomExternalForce("-pull*z")
        force.addPerParticleParameter("pull")
        for nodes in filaments.node_indices:
            force.addParticle(int(nodes[-1]), [max(pull, END)])
            force.addParticle(int(nodes[-2]), [pull - max(pull, END)])
        system.addForce(force)
    if contacts:
        system.addForce(capsule_contact_force(filaments, system, 2.0))
    integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False, precision=precision)
    integrator.setPathLevel(level)
    context = new_context(system, positions, integrator, platform)
    return context, filaments.in_context(context)


def mean_and_error(samples):
    """Of samples (times, filaments), which are independent from filament to filament."""
    of_filaments = np.mean(samples, axis=0)
    return of_filaments.mean(), of_filaments.std(ddof=1) / np.sqrt(len(of_filaments))


def assert_near(samples, exact, error=0.05):
    mean, deviation = mean_and_error(np.array(samples))
    assert SIGMAS * deviation < error * abs(exact), "too few samples to tell"
    assert mean == pytest.approx(exact, abs=SIGMAS * deviation)


def rates_of_turns(segments, minus=None, plus=None):
    """How fast turns of a straight chain decay, that of a frame at either end among them: a matrix.

    The frames have these frictions, and are held where there is none.
    """
    stiffness = np.zeros((segments + 2, segments + 2))
    for joint in range(segments + 1):
        gradient = np.zeros(segments + 2)
        gradient[joint : joint + 2] = -1.0, 1.0
        own = DNA.twist_stiffness * (2.0 if joint in (0, segments) else 1.0)
        stiffness += own * np.outer(gradient, gradient)
    frames = [np.inf if friction is None else friction for friction in (minus, plus)]
    frictions = np.full(segments, DNA.axial_friction(VISCOSITY))
    return stiffness / np.array([frames[0], *frictions, frames[1]])[:, None]


def mean_square_angle_of_an_end(segments, time):
    """By which an end of a straight chain turns: of its discrete Rouse modes, and of the whole."""
    friction, stiffness = DNA.axial_friction(VISCOSITY), DNA.twist_stiffness
    joints = np.diff(np.eye(segments), axis=0)
    values, modes = np.linalg.eigh(stiffness * joints.T @ joints)
    own = values[1:], modes[0, 1:] ** 2
    whole = 2 * KT * time / (friction * segments)
    return whole + np.sum(own[1] * 2 * KT / own[0] * (1 - np.exp(-own[0] * time / friction)))


def squares_of_end_angles(step, time, segments, chains=64, **options):
    """Of both free ends of straight chains: squares of what they turn by in a time, (times, chains)."""
    generator = np.random.default_rng(1)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(chains):
        start, kind = [0, 0, 100.0 * number], replace(DNA, bending_rigidity=1e5 * KT)
        filaments.add_straight(kind, segments, start, [1, 0, 0], clamped=[0, 1], **options)
    context, own = in_context(filaments, step)
    for number in range(chains):
        drawn = generator.normal(0.0, np.sqrt(LENGTH / 100), segments - 1)
        own.set_twists(number, np.concatenate([[0], drawn, [0]]))
    angles = []
    for _ in range(161):
        angles.append([own.twists(number)._value[[0, -1]] for number in range(chains)])
        context.getIntegrator().step(round(time / step))
    return (np.diff(angles, axis=0) ** 2).mean(axis=2)
