"""Contexts with linkers: whether they go on to the bit, in traps, and how far fixed motors move a filament."""

import numpy as np
import openmm

from openmm_cylchain import F_ACTIN, Crosslinker, Crosslinks, Hand
from support.contexts import new_context, positions_of

SECOND = 1e12
PICONEWTON = 0.602214076


def same_linkers(first, second):
    """Whether two LinkerTables are equal to the bit."""
    names = first.__dataclass_fields__
    return all(np.array_equal(getattr(first, name), getattr(second, name), equal_nan=True) for name in names)


def check_that_runs_go_on_to_the_bit(network):
    """From a checkpoint in the same Context, and from XML of a State in another one.

    Parameters
    ----------
    network : callable
        Makes filaments and a Context, the same ones each time.

    Returns
    -------
    filaments, linkers at the end
    """
    filaments, context = network()
    here = filaments.in_context(context)
    integrator = context.getIntegrator()
    integrator.step(100)
    checkpoint = context.createCheckpoint()
    state = context.getState(positions=True, parameters=True, integratorParameters=True)
    integrator.step(60)
    expected = here.linkers(), positions_of(context)
    context.loadCheckpoint(checkpoint)
    integrator.step(60)
    assert same_linkers(here.linkers(), expected[0])
    assert np.array_equal(positions_of(context), expected[1])
    # In another Context of the same System, from XML.
    other, fresh = network()
    fresh.setState(openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(state)))
    fresh.getIntegrator().step(60)
    assert same_linkers(other.in_context(fresh).linkers(), expected[0])
    assert np.array_equal(positions_of(fresh), expected[1])
    return filaments, expected[0]


def fixed_filament(filaments, segments, start):
    """A filament of which only the last node moves, far from all else."""
    nodes = np.array(start) + 100.0 * np.arange(segments + 1)[:, None] * np.array([1.0, 0.0, 0.0])
    return filaments.add_nodes(F_ACTIN.with_segment_length(100.0), nodes, clamped=range(segments))


def context_with_trapped_linkers(filaments, crosslinker, centres, trap, friction, step):
    """Particles in harmonic traps, each with a linker on it.

    Parameters
    ----------
    filaments : Filaments
        With the filaments that hands may bind.
    crosslinker : Crosslinker
    centres : (particles, 3) array
        Of traps.
    trap, friction : float
        Stiffness of a trap, and friction of a particle.
    step : float
    """
    system, topology = openmm.System(), openmm.app.Topology()
    chain = topology.addChain()
    for _ in centres:
        system.addParticle(1.0)
        topology.addAtom("P", None, topology.addResidue("P", chain))
    filaments.add_linkers(crosslinker, anchors=np.arange(len(centres)))
    positions = filaments.add_to(topology, system, centres)
    traps = Crosslinks(stiffness=trap, rest_length=0.0)
    for particle, centre in enumerate(centres):
        traps.add(None, particle, centre)
    traps.add_to(system)
    integrator = filaments.create_integrator(system, step, particle_friction=friction, random_seed=3, checks=False)
    return new_context(system, positions, integrator)


def glide(filaments):
    """Let motors on fixed points, of 1000 nm/s, move a filament along x for a second.

    Returns
    -------
    system, step, displacement of the centre in nm
    """
    hand = Hand(
        binding_rate=200.0 / SECOND,
        reach=40.0,
        unbinding_rate=5.0 / SECOND,
        speed=1000.0 / SECOND,
        stall_force=6.0 * PICONEWTON,
    )
    generator = np.random.default_rng(1)
    points = np.column_stack([generator.uniform(-4000.0, 2000.0, 1200), generator.normal(0.0, 10.0, (1200, 2))])
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.1 * PICONEWTON), anchors=points)
    _, system, positions = filaments.build()
    step = 1e-4 * SECOND
    integrator = filaments.create_integrator(system, step, random_seed=2, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(2000)
    nodes = filaments.node_indices[0]
    start = positions_of(context)[nodes].mean(axis=0)
    integrator.step(10000)
    return system, step, positions_of(context)[nodes].mean(axis=0) - start
