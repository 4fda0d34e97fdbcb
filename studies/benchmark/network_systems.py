"""The networks of the benchmark of networks: filaments at random in a periodic box, with links and contacts."""

from dataclasses import dataclass, replace

import numpy as np
import openmm
from scipy.spatial import cKDTree

from openmm_cylchain import F_ACTIN, Crosslinks, Filaments, SegmentPlace, capsule_contact_force
from openmm_cylchain.analysis.crossings import CrossingCounter
from openmm_cylchain.units.quantities import thermal_energy

from . import systems

SEGMENTS = 10
ACTIN = F_ACTIN.with_segment_length(100.0)
PICONEWTON_PER_NANOMETER = 0.602214076
"""In kJ/(mol nm^2)."""

CONTACT_DIAMETER = 30.0
CONTACT_STIFFNESS = 0.38 * PICONEWTON_PER_NANOMETER
"""With which crossing costs 40 k_BT."""

_MICROSECOND = 1e6
_LINK_GROUP, _CONTACT_GROUP = 1, 2
_SEED = 1
_NOWHERE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class NetworkSystem:
    """Filaments in a periodic box, with links between them, contacts, or both.

    Attributes
    ----------
    name : str
        For rows.
    steps : tuple of float
        Of the implicit scheme, in us. The last one is that of the rows without a step in their names.
    explicit_step : float
        In us, of the implicit scheme with links and contacts that are explicit.
    edge : float
        Of the box, in nm.
    filaments : int
    contacts : bool
    links : int
        How many there are: those between the segments that are nearest to each other when filaments are drawn.
    stiffness, rest_length : float
        Of links, in pN/nm and nm.
    """

    name: str
    steps: tuple
    explicit_step: float
    edge: float = 1200.0
    filaments: int = 200
    contacts: bool = False
    links: int = 0
    stiffness: float = 0.0
    rest_length: float = 0.0


NETWORKS = (
    NetworkSystem("contacts", (5.0, 10.0), 0.5, contacts=True),
    NetworkSystem("links_very_soft", (20.0, 50.0, 100.0), 0.5, links=1000, stiffness=0.1),
    NetworkSystem("links_soft", (20.0, 50.0, 100.0), 0.2, links=1000, stiffness=0.25),
    NetworkSystem("links_stiff", (20.0, 50.0, 100.0), 0.0005, edge=700.0, links=900, stiffness=100.0),
    NetworkSystem("links_35_nm", (10.0, 20.0), 0.2, links=1000, stiffness=0.25, rest_length=35.0),
    NetworkSystem("contacts_and_links", (5.0, 10.0), 0.2, contacts=True, links=1000, stiffness=0.25, rest_length=35.0),
)
"""Stiff links are in a dense box, where segments nearly touch."""


def enlarged(system, factor):
    """A system of so many times as many filaments and links, in a box of the same density."""
    return replace(
        system,
        edge=system.edge * factor ** (1 / 3),
        filaments=round(factor * system.filaments),
        links=round(factor * system.links),
    )


@dataclass(frozen=True)
class Network:
    """A network in a Context; ``links`` is None where there are none."""

    system: NetworkSystem
    filaments: Filaments
    links: Crosslinks | None
    context: openmm.Context

    @property
    def node_count(self):
        """Nodes of all filaments, the first particles of the System."""
        return self.system.filaments * (SEGMENTS + 1)

    @property
    def integrator(self):
        """Of the Context."""
        return self.context.getIntegrator()

    def positions(self):
        """Of all nodes, in nm, not wrapped into the box."""
        return self.context.getState(positions=True).getPositions(asNumpy=True)._value[: self.node_count]

    def count_crossings(self, steps):
        """How often filaments pass through each other in so many steps, each of them looked at."""
        counter = CrossingCounter(self.filaments, self.positions(), self.system.edge * np.eye(3))
        for _ in range(steps):
            self.integrator.step(1)
            counter.update(self.positions())
        return counter.count

    def energies(self):
        """Energies by name, in k_BT: of links and contacts as far as there are any, of stretching and bending."""
        groups = {"link": _LINK_GROUP} if self.links is not None else {}
        if self.system.contacts:
            groups["contact"] = _CONTACT_GROUP
        energies = {
            name: self.context.getState(energy=True, groups={group}).getPotentialEnergy()._value
            for name, group in groups.items()
        }
        vectors = np.diff(self.positions().reshape(self.system.filaments, SEGMENTS + 1, 3), axis=1)
        lengths = np.linalg.norm(vectors, axis=2)
        tangents = vectors / lengths[..., None]
        cosines = np.einsum("csk,csk->cs", tangents[:, 1:], tangents[:, :-1])
        energies["stretching"] = float(ACTIN.stretching_energy(lengths).sum())
        energies["bending"] = float(ACTIN.bending_energy(cosines).sum())
        kT = thermal_energy(systems.TEMPERATURE)
        return {name: energy / kT for name, energy in energies.items()}


def create_network(system, scheme, step, positions=None, seed=1, explicit_couplings=False, threads=1):
    """A network in a Context, on one thread if no more are asked for.

    Parameters
    ----------
    system : NetworkSystem
    scheme : str
    step : float or None
        In us; that which is recommended for the scheme if None.
    positions : (nodes, 3) array, optional
        In nm; as drawn if not given. Links are those of the filaments as drawn.
    seed : int
        Of the noise.
    explicit_couplings : bool
        Whether links and contacts are explicit in an implicit scheme, too. They are if they act on a virtual site that
        is not on a segment: one is added, which nothing touches.
    threads : int

    Returns
    -------
    Network
    """
    filaments = Filaments(systems.VISCOSITY, systems.TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(_SEED)
    for number in range(system.filaments):
        filaments.add_equilibrium(ACTIN, SEGMENTS, seed=number, start=generator.uniform(0.0, system.edge, 3))
    _, openmm_system, drawn = filaments.build(box_vectors=system.edge * np.eye(3))
    drawn = drawn._value
    sites = _add_virtual_site(openmm_system) if explicit_couplings else []
    links = None
    if system.links:
        links = Crosslinks(system.stiffness * PICONEWTON_PER_NANOMETER, system.rest_length)
        links.add_many(None, nearest_places(filaments, drawn, system.edge)[: system.links])
        for site in sites:
            links.add(None, site, _NOWHERE, rest_length=0.0)
        links.add_to(openmm_system, force_group=_LINK_GROUP, periodic=True)
    if system.contacts:
        force = capsule_contact_force(
            filaments, openmm_system, CONTACT_DIAMETER, CONTACT_STIFFNESS, sites, 1.0 if sites else None, periodic=True
        )
        for sphere in range(len(sites)):
            for filament in range(system.filaments):
                for segment in range(SEGMENTS):
                    force.addExclusion(-1, sphere, filament, segment)
        force.setForceGroup(_CONTACT_GROUP)
        openmm_system.addForce(force)
    if step is None:
        step = filaments.recommended_time_step(scheme=scheme, system=openmm_system).step / _MICROSECOND
    integrator = filaments.create_integrator(
        openmm_system, step * _MICROSECOND, scheme=scheme, random_seed=seed, checks=False
    )
    nodes = drawn if positions is None else positions
    others = np.tile(_NOWHERE, (openmm_system.getNumParticles() - len(nodes), 1))
    platform = None if threads == 1 else ("CPU", {"Threads": str(threads)})
    context = systems.one_thread_context(openmm_system, integrator, np.concatenate([nodes, others]), platform)
    return Network(system, filaments, links, context)


def _add_virtual_site(system):
    # Of three particles that do not move; one of two is a place that a step knows.
    *particles, site = (system.addParticle(0.0) for _ in range(4))
    system.setVirtualSite(site, openmm.ThreeParticleAverageSite(*particles, 0.25, 0.25, 0.5))
    return [site]


_COLD = 1.0
_COLD_STEPS = (1e-3, 1e-2, 0.1, 1.0)
_WARM_STEPS = (1e-2, 0.1, 1.0)


def relaxed_positions(system, steps):
    """Positions in which filaments that were drawn on top of each other have come apart, and links are in equilibrium.

    Filaments come apart in the cold, in steps that grow: where two axes nearly meet, noise would let them cross.

    Parameters
    ----------
    system : NetworkSystem
    steps : int
        How many, of the longest, come last.

    Returns
    -------
    (nodes, 3) array
        In nm.
    """
    network = create_network(system, "implicit", _COLD_STEPS[0])
    if system.contacts:
        network.integrator.setTemperature(_COLD)
        _step(network, _COLD_STEPS, 20)
        network.integrator.setTemperature(systems.TEMPERATURE)
    _step(network, _WARM_STEPS, 50)
    _step(network, system.steps[-1:], steps)
    return network.positions()


def _step(network, lengths, steps):
    for length in lengths:
        network.integrator.setStepSize(length * _MICROSECOND)
        network.integrator.step(steps)


def nearest_places(filaments, positions, edge):
    """Where segments of different filaments are nearest to each other, the nearest pair of segments first.

    Parameters
    ----------
    filaments : Filaments
    positions : (particles, 3) array
        In nm.
    edge : float
        Of the periodic box.

    Returns
    -------
    list of pairs of SegmentPlace
        Of segments that are at most half of their length apart.
    """
    nodes = np.array(filaments.node_indices)
    first, second = nodes[:, :-1].ravel(), nodes[:, 1:].ravel()
    owner = np.repeat(np.arange(len(nodes)), nodes.shape[1] - 1)
    vectors = positions[second] - positions[first]
    middles = positions[first] + 0.5 * vectors
    longest = np.linalg.norm(vectors, axis=1).max()
    a, b = cKDTree(np.mod(middles, edge), boxsize=edge).query_pairs(1.5 * longest, output_type="ndarray").T
    a, b = a[owner[a] != owner[b]], b[owner[a] != owner[b]]
    between = middles[b] - middles[a]
    between -= edge * np.round(between / edge)
    s, t = _nearest_fractions(vectors[a], vectors[b], between)
    gaps = np.linalg.norm(between + t[:, None] * vectors[b] - s[:, None] * vectors[a], axis=1)
    order = np.argsort(gaps, kind="stable")
    return [
        (
            SegmentPlace(int(first[a[pair]]), int(second[a[pair]]), 0.5 + s[pair]),
            SegmentPlace(int(first[b[pair]]), int(second[b[pair]]), 0.5 + t[pair]),
        )
        for pair in order[gaps[order] <= 0.5 * longest]
    ]


def _nearest_fractions(p, q, w):
    # Of segments around their middles, which w joins. The distance is convex, so that places may be clipped in turn.
    pp, qq, pq = np.sum(p * p, axis=1), np.sum(q * q, axis=1), np.sum(p * q, axis=1)
    pw, qw = np.sum(p * w, axis=1), np.sum(q * w, axis=1)
    s = np.clip((pw * qq - qw * pq) / np.maximum(pp * qq - pq**2, 1e-12 * pp * qq), -0.5, 0.5)
    t = np.clip((s * pq - qw) / qq, -0.5, 0.5)
    return np.clip((t * pq + pw) / pp, -0.5, 0.5), t
