"""Small networks of filaments with links in the compiled engine: many copies, exact averages and Monte Carlo."""

from dataclasses import dataclass, field

import numpy as np
import openmm
from openmm import app
from scipy.integrate import cumulative_trapezoid

from openmm_cylchain import F_ACTIN, Crosslinks, Filaments
from openmm_cylchain.filaments.equilibrium import JointAngleDistribution, SegmentLengthDistribution, draw_chain
from support.contexts import new_context, positions_of
from support.linked_pairs import PICONEWTON_PER_NANOMETER
from support.solvent import KT, TEMPERATURE, VISCOSITY

ACTIN = F_ACTIN.with_segment_length(100)
MICROSECOND = 1e6
# Of particles outside filaments, in kJ ps/(mol nm^2): about that of a segment of actin.
PARTICLE_FRICTION = 5e5
POINT = (40.0, -20.0, 300.0)


@dataclass(frozen=True)
class LinkPotential:
    """Of all links of a network: stiffness in pN/nm, lengths in nm."""

    stiffness: float
    rest_length: float = 0.0
    maximum_extension: float | None = None

    @property
    def model(self):
        return "harmonic" if self.maximum_extension is None else "fene"

    def energy(self, distance):
        """In k_B T."""
        k, e, D = self.stiffness * PICONEWTON_PER_NANOMETER / KT, distance - self.rest_length, self.maximum_extension
        return 0.5 * k * e**2 if D is None else -0.5 * k * D**2 * np.log1p(-np.minimum((e / D) ** 2, 1 - 1e-15))

    def _grid(self):
        sigma = np.sqrt(KT / (self.stiffness * PICONEWTON_PER_NANOMETER))
        reach = 9 * sigma if self.maximum_extension is None else min(9 * sigma, self.maximum_extension)
        distance = np.linspace(max(0.0, self.rest_length - reach), self.rest_length + reach, 40001)
        weight = distance**2 * np.exp(-self.energy(distance))
        cumulative = cumulative_trapezoid(weight, distance, initial=0.0)
        return distance, cumulative / cumulative[-1]

    def mean(self, function):
        """Exact average of a function of the distance, with the density d^2 exp(-V/k_B T)."""
        distance, cumulative = self._grid()
        middles = 0.5 * (distance[1:] + distance[:-1])
        return np.sum(function(middles) * np.diff(cumulative))

    def draw(self, generator, count):
        """Vectors in equilibrium: an array (count, 3)."""
        distance, cumulative = self._grid()
        direction = generator.normal(size=(count, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return direction * np.interp(generator.random(count), cumulative, distance)[:, None]

    def crosslinks(self):
        return Crosslinks(
            self.stiffness * PICONEWTON_PER_NANOMETER, self.rest_length, self.model, self.maximum_extension
        )


@dataclass(frozen=True)
class Network:
    """Filaments of one type, particles outside them, and links.

    A place is (filament, segment, fraction), (particle,), or a point (x, y, z) of floats. Of each link, one place is on
    what links before it hold already, or is a point; links that close loops come last.
    """

    links: tuple
    filaments: int
    segments: int = 6
    particles: int = 0
    kind: object = field(default=ACTIN)

    def draw(self, potential, copies, generator):
        """Nodes (copies, filaments, nodes, 3) and particles (copies, particles, 3): of a tree, in equilibrium."""
        nodes = np.array(
            [
                [draw_chain(self.kind, self.segments, TEMPERATURE, generator) for _ in range(self.filaments)]
                for _ in range(copies)
            ]
        )
        particles = np.zeros((copies, self.particles, 3))
        placed = set()
        for first, second in self.links:
            if self._body(second) in placed or self._body(second) == "point":
                first, second = second, first
            if self._body(second) in placed:
                continue
            assert self._body(first) in placed or self._body(first) == "point" or not placed
            placed |= {self._body(first), self._body(second)}
            shift = self.at(first, nodes, particles) + potential.draw(generator, copies)
            shift -= self.at(second, nodes, particles)
            if len(second) == 1:
                particles[:, second[0]] += shift
            else:
                nodes[:, second[0]] += shift[:, None]
        return nodes, particles

    @staticmethod
    def _body(place):
        if isinstance(place[0], float):
            return "point"
        return ("particle" if len(place) == 1 else "filament", place[0])

    @staticmethod
    def at(place, nodes, particles):
        """Where a place is in each copy: an array (copies, 3)."""
        if isinstance(place[0], float):
            return np.broadcast_to(np.array(place), (len(nodes), 3))
        if len(place) == 1:
            return particles[:, place[0]]
        filament, segment, fraction = place
        return (1 - fraction) * nodes[:, filament, segment] + fraction * nodes[:, filament, segment + 1]

    def distances(self, nodes, particles):
        """An array (copies, links)."""
        vectors = [self.at(a, nodes, particles) - self.at(b, nodes, particles) for a, b in self.links]
        return np.linalg.norm(vectors, axis=2).T

    def energies(self, potential, nodes, particles):
        """Means per copy, in k_B T: of each link (copies, links), of lengths and of bends."""
        difference = np.diff(nodes, axis=2)
        length = np.linalg.norm(difference, axis=3)
        tangent = difference / length[..., None]
        cosine = np.einsum("cfjk,cfjk->cfj", tangent[:, :, 1:], tangent[:, :, :-1])
        return {
            "links": potential.energy(self.distances(nodes, particles)),
            "stretching": self.kind.stretching_energy(length).mean(axis=(1, 2)) / KT,
            "bending": self.kind.bending_energy(cosine).mean(axis=(1, 2)) / KT,
        }

    def free_energies(self):
        """Exact means of the same for lengths and bends of filaments without links, or in a tree of them."""
        lengths = SegmentLengthDistribution(self.kind, TEMPERATURE)
        cosines = JointAngleDistribution(self.kind, TEMPERATURE)
        return {
            "stretching": lengths.mean(self.kind.stretching_energy) / KT,
            "bending": cosines.mean(self.kind.bending_energy) / KT,
        }


class Simulation:
    """Copies of a network in one Context, on one thread."""

    def __init__(self, network, potential, nodes, particles, scheme, step, seed=7, temperature=None, sets=1, threads=1,
                 precision="automatic"):  # fmt: skip
        self.network, self.potential = network, potential
        copies = len(nodes)
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        topology, system = app.Topology(), openmm.System()
        for _ in range(particles.shape[0] * particles.shape[1]):
            topology.addAtom("P", None, topology.addResidue("PRT", topology.addChain()))
            system.addParticle(1.0)
        for own in nodes.reshape(-1, *nodes.shape[2:]):
            filaments.add_nodes(network.kind, own)
        positions = filaments.add_to(topology, system, particles.reshape(-1, 3).tolist())
        # Several sets divide the links among several forces.
        self.crosslinks = [potential.crosslinks() for _ in range(sets)]
        pairs = [[] for _ in range(sets)]
        for copy in range(copies):
            for number, link in enumerate(network.links):
                ends = []
                for place in link:
                    if isinstance(place[0], float):
                        ends.append(list(place))
                    elif len(place) == 1:
                        ends.append(copy * network.particles + place[0])
                    else:
                        segment, fraction = place[1:]
                        ends.append(
                            filaments.segment_place(
                                copy * network.filaments + place[0], segment=segment, fraction=fraction
                            )
                        )
                pairs[number % sets].append(ends)
        for one, own in zip(self.crosslinks, pairs):
            one.add_many(None, own)
            one.add_to(system)
        self.integrator = filaments.create_integrator(
            system, step, scheme=scheme, temperature=temperature, particle_friction=PARTICLE_FRICTION,
            random_seed=seed, checks=False, precision=precision,
        )  # fmt: skip
        self.filaments, self.system, self.shape = filaments, system, (nodes.shape, particles.shape)
        self.context = new_context(system, positions, self.integrator, "CPU", {"Threads": str(threads)})

    def configuration(self):
        """Nodes and particles, as ``Network.draw`` returns them."""
        positions = positions_of(self.context)
        count = int(np.prod(self.shape[1][:2]))
        return positions[count:].reshape(self.shape[0]), positions[:count].reshape(self.shape[1])

    def measure(self, samples, interval):
        """Means over samples, each after so many steps, for each copy: as ``Network.energies``."""
        sums = None
        for _ in range(samples):
            self.integrator.step(interval)
            energies = self.network.energies(self.potential, *self.configuration())
            sums = energies if sums is None else {name: sums[name] + energies[name] for name in sums}
        return {name: value / samples for name, value in sums.items()}


def mean_and_error(values):
    """Over copies, the first axis; others are averaged before."""
    values = values.reshape(len(values), -1).mean(axis=1)
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values))


def monte_carlo(network, potential, nodes, particles, moves, generator, samples=0):
    """Metropolis moves of copies of a network: translations, rotations, bends and lengths of filaments, particles.

    Returns nodes, particles and, if there are samples, the means of ``Network.energies`` over them for each copy.
    """
    nodes, particles = nodes.copy(), particles.copy()
    copies, kind = len(nodes), network.kind

    def of_links(nodes, particles):
        return potential.energy(network.distances(nodes, particles)).sum(axis=1)

    def of_joint(tail, joint):
        ahead, behind = tail[:, joint + 1] - tail[:, joint], tail[:, joint] - tail[:, joint - 1]
        cosine = np.sum(ahead * behind, axis=1)
        cosine /= np.linalg.norm(ahead, axis=1) * np.linalg.norm(behind, axis=1)
        return kind.bending_energy(cosine) / KT

    energy = of_links(nodes, particles)
    sums = None
    for move in range(moves):
        scale = 10.0 ** generator.uniform(-2, 0)
        new_nodes, new_particles, log_weight = nodes, particles, np.zeros(copies)
        which = generator.integers(network.filaments + network.particles)
        if which >= network.filaments:
            new_particles = particles.copy()
            new_particles[:, which - network.filaments] += 50 * scale * generator.normal(size=(copies, 3))
        else:
            new_nodes = nodes.copy()
            own = new_nodes[:, which]
            action, node = generator.integers(4), generator.integers(1, network.segments)
            if action == 0:
                own += 50 * scale * generator.normal(size=(copies, 1, 3))
            elif action == 3:
                # One length: nodes behind it move along it.
                segment = generator.integers(network.segments)
                old = own[:, segment + 1] - own[:, segment]
                length = np.linalg.norm(old, axis=1)
                width = np.sqrt(KT / kind.segment_stiffness)
                new = length + width * generator.normal(size=copies)
                log_weight += 2 * np.log(new / length)
                log_weight -= (kind.stretching_energy(new) - kind.stretching_energy(length)) / KT
                own[:, segment + 1 :] += (old * (new / length - 1)[:, None])[:, None]
            else:
                # Turn the whole filament, or what lies behind a joint.
                axis = generator.normal(size=(copies, 3))
                axis /= np.linalg.norm(axis, axis=1)[:, None]
                first = 0 if action == 1 else node
                angle = scale * (1 if action == 1 else 0.2) * generator.normal(size=(copies, 1, 1))
                arms, axis = own[:, first:] - own[:, node : node + 1], axis[:, None]
                turned = arms * np.cos(angle) + np.cross(axis, arms) * np.sin(angle)
                turned += axis * np.sum(axis * arms, axis=2, keepdims=True) * (1 - np.cos(angle))
                if action == 2:
                    log_weight += of_joint(own, node)
                own[:, first:] = own[:, node : node + 1] + turned
                if action == 2:
                    log_weight -= of_joint(own, node)
        new_energy = of_links(new_nodes, new_particles)
        accepted = np.log(generator.random(copies)) < log_weight + energy - new_energy
        energy = np.where(accepted, new_energy, energy)
        if which >= network.filaments:
            particles[accepted] = new_particles[accepted]
        else:
            nodes[accepted] = new_nodes[accepted]
        if samples and (move + 1) % max(1, moves // samples) == 0:
            energies = network.energies(potential, nodes, particles)
            energies["samples"] = np.ones(copies)
            sums = energies if sums is None else {name: sums[name] + energies[name] for name in sums}
    if sums is None:
        return nodes, particles
    count = sums.pop("samples")[0]
    return nodes, particles, {name: value / count for name, value in sums.items()}
