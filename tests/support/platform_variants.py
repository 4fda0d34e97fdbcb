"""Filaments of every kind that platforms must compute alike: models, shapes, what holds and drives them."""

from dataclasses import replace

import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import DSDNA_BASE_PAIRS, F_ACTIN, Filaments, Flow, stokes_friction
from openmm_cylchain.time_steps.stability import stability_bounds
from support.solvent import KT, TEMPERATURE, VISCOSITY

ACTIN = replace(F_ACTIN, name="ACT60", segment_length=60.0)
FENE = replace(
    ACTIN, name="FENE", stretching_stiffness=100 * KT / 60**2, stretching_model="fene", maximum_extension=20.0
)
SHEAR = Flow([1e-6, 0, 2e-6], [[0, 3e-7, 0], [0, 0, 1e-7], [0, 0, 0]], origin=[10, 20, 30])


def _add(filaments, shape=None, type=ACTIN, **keys):
    """Three filaments, of which two are of the same length."""
    for number, segments in enumerate((12, 12, 7)):
        start = [0.0, 500.0 * number, 20.0]
        if shape == "ring":
            filaments.add_ring(type, segments, start, [1, 2, 3], **keys)
        else:
            filaments.add_equilibrium(type, segments, seed=number, start=start, **keys)


def _tethered(filaments):
    _add(filaments)
    for filament, node in ((0, 0), (0, 12), (1, 5), (2, 3)):
        filaments.add_tether(filament, node, [30.0, 500.0 * filament, 10.0], 2e-3)


def _planar_ring(filaments):
    for number in range(2):
        filaments.add_ring(ACTIN, 8 + number, [0, 900 * number, 3], planar=True, propulsion=0.2)


VARIANTS = {
    "open": _add,
    "fixed": lambda filaments: _add(filaments, clamped=[0, 1]),
    "tethered": _tethered,
    "propelled": lambda filaments: _add(filaments, propulsion=0.5),
    "planar": lambda filaments: _add(filaments, planar=True),
    "ring": lambda filaments: _add(filaments, "ring"),
    "planar ring": _planar_ring,
    "fene": lambda filaments: _add(filaments, type=FENE),
    "kratky-porod": lambda filaments: _add(filaments, type=replace(ACTIN, bending_model="kratky-porod")),
    "quadratic": lambda filaments: _add(filaments, type=replace(ACTIN, bending_model="quadratic")),
    "beads": lambda filaments: _add(filaments, type=DSDNA_BASE_PAIRS),
}


def filaments_of_variant(name, flow=None, pushed=True):
    """The filaments, their System with four beads and a force on all, positions and the arguments of an integrator."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    VARIANTS[name](filaments)
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for _ in range(4):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(1e5)
    beads = np.random.default_rng(3).uniform(-200, 0, size=(4, 3))
    positions = filaments.add_to(topology, system, beads * unit.nanometer)
    if pushed:
        # Of which OpenMM's platforms for GPUs lose nothing: they add forces in units of 2^-32 kJ/(mol nm).
        push = openmm.CustomExternalForce("-0.3125*x-0.125*y")
        for particle in range(system.getNumParticles()):
            push.addParticle(particle, [])
        system.addForce(push)
    return filaments, system, positions, {"particle_friction": stokes_friction(50, VISCOSITY), "flow": flow}


def step_of_variant(name, scheme):
    """A step that is long for the scheme, in ps."""
    kind = DSDNA_BASE_PAIRS if name == "beads" else FENE if name == "fene" else ACTIN
    if scheme in ("euler", "midpoint"):
        return 0.1 * min(stability_bounds(kind, VISCOSITY, TEMPERATURE, 12).values())
    return 30.0 if name == "beads" else 2e6
