"""Small networks of which everything is drawn: filaments, box, contacts, links, walls, particles, scheme and step."""

from dataclasses import dataclass

import numpy as np
import openmm
from openmm import app, unit

from openmm_cylchain import (
    DSDNA,
    F_ACTIN,
    MICROTUBULE,
    Crosslinks,
    Filaments,
    Sphere,
    capsule_contact_force,
    filament_wall_force,
)
from support.contexts import new_context
from support.linked_pairs import PICONEWTON_PER_NANOMETER
from support.solvent import KT, TEMPERATURE, VISCOSITY

KINDS = (F_ACTIN.with_segment_length(100), F_ACTIN, MICROTUBULE, DSDNA)
PARTICLE_FRICTION = 4e5
PARTICLE_DIAMETER = 40.0
TRICLINIC = 1.3 * np.array([[1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [-0.2, 0.4, 1.0]])
GROUPS = range(4)  # Of forces: those of chains, contacts, links and walls.


def _some(generator, probability, value, otherwise):
    return value if generator.random() < probability else otherwise


@dataclass
class RandomNetwork:
    """The same number draws the same network."""

    seed: int

    def __post_init__(self):
        self._generator = np.random.default_rng(self.seed)
        self._planar = self._generator.random() < 0.12
        self._kinds = [kind for kind in KINDS if self._generator.random() < 0.4] or KINDS[:1]
        self._diameter = float(self._generator.choice([10, 25, 30]))
        longest = max(kind.segment_length for kind in self._kinds)
        self._edge = 2 * (1.2 * longest + 2 * PARTICLE_DIAMETER) * self._generator.choice([1.02, 1.3, 2.0])
        self.filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
        for number in range(self._generator.integers(1, 10)):
            self._add_filament(number)
        self._add_to_system()
        self._add_contacts()
        self._add_links()
        self._add_wall()
        recommended = self.filaments.recommended_time_step(system=self.system, particle_friction=self._friction)
        self.factor = float(self._generator.choice([0.1, 1, 1, 1, 3, 10]))
        self.step = self.factor * recommended.step
        # Contacts and walls are for "implicit".
        self._scheme = _some(self._generator, 0.67, "implicit", "implicit-second-order")
        if {force.getForceGroup() for force in self.system.getForces()} & {1, 3}:
            self._scheme = "implicit"
        self._precision = _some(self._generator, 0.5, "automatic", "double")

    def context(self, share):
        """With an integrator that takes a share of the drawn step, after what lay overlapping has come apart at 1 K."""
        step = share * self.step
        # An integrator adds a force to its System.
        system = openmm.XmlSerializer.clone(self.system)
        integrator = self.filaments.create_integrator(
            system,
            step,
            self._scheme,
            particle_friction=self._friction,
            random_seed=self.seed + 1,
            precision=self._precision,
        )
        context = new_context(system, self._positions, integrator)
        integrator.setTemperature(1.0)
        for part in 10.0 ** np.arange(-4, 0):
            integrator.setStepSize(part * step / max(1.0, self.factor))
            integrator.step(60)
        integrator.setStepSize(step)
        integrator.setTemperature(TEMPERATURE)
        return context

    def _add_filament(self, number):
        generator = self._generator
        kind, segments = self._kinds[generator.integers(len(self._kinds))], int(generator.integers(1, 9))
        start = generator.uniform(0, self._edge, 3)
        start[2] *= not self._planar
        normal = generator.normal(size=3)
        options = {
            "clamped": ((), (), (), (0,), (0, 1))[generator.integers(5)] if segments > 2 else (),
            "planar": self._planar,
            "propulsion": _some(generator, 0.25, PICONEWTON_PER_NANOMETER, 0.0),
        }
        if segments >= 4 and generator.random() < 0.15:
            self.filaments.add_ring(kind, segments, start, (0, 0, 1) if self._planar else normal, **options)
        else:
            self.filaments.add_equilibrium(kind, segments, int(generator.integers(1 << 20)), start, **options)
        if generator.random() < 0.15:
            self.filaments.add_tether(number, 0, start, PICONEWTON_PER_NANOMETER * 10 ** generator.uniform(-2, 2))

    def _add_to_system(self):
        generator, topology, self.system = self._generator, app.Topology(), openmm.System()
        self._box = None
        if generator.random() < 0.6:
            self._box = self._edge * _some(generator, 0.3, TRICLINIC, np.eye(3))
            self.system.setDefaultPeriodicBoxVectors(*self._box)
        self._particles = 0 if self._planar else _some(generator, 0.33, 3, 0)
        self._friction = PARTICLE_FRICTION if self._particles else None
        chain = topology.addChain()
        for _ in range(self._particles):
            topology.addAtom("B", None, topology.addResidue("BEA", chain))
            self.system.addParticle(1e5)
        beads = generator.uniform(0, self._edge, (self._particles, 3)) * unit.nanometer
        self._positions = self.filaments.add_to(topology, self.system, beads)

    def _add(self, force, group):
        force.setForceGroup(group)
        self.system.addForce(force)

    def _add_contacts(self):
        if self._generator.random() < 0.6:
            diameter = PARTICLE_DIAMETER if self._particles else None
            beads = range(self._particles)
            self._add(capsule_contact_force(self.filaments, self.system, self._diameter, None, beads, diameter), 1)

    def _add_links(self):
        """Between places that are about as far apart as links want; some twice."""
        generator = self._generator
        wanted = int(generator.choice([0, 0, 2, 6, 15]))
        stiffness = PICONEWTON_PER_NANOMETER * 10 ** generator.uniform(-2, 3)
        rest_length = float(generator.choice([0, 0, 35, 100]))
        extension = _some(generator, 0.2, 60.0, None)
        slack = 1 + min(3 * np.sqrt(KT / stiffness), 50)
        pairs = []
        for _ in range(200 * wanted):
            places = [self._place(), self._place()]
            distance = self._distance(places)
            # Two places at a distance of zero are one node.
            if len(pairs) < wanted and distance > 1e-9 and abs(distance - rest_length) < slack:
                pairs += [places] * _some(generator, 0.1, 2, 1)
        if pairs:
            model = "harmonic" if extension is None else "fene"
            links = Crosslinks(stiffness, rest_length, model, extension)
            links.add_many(None, pairs)
            links.add_to(self.system, force_group=2)

    def _place(self):
        filament = int(self._generator.integers(len(self.filaments)))
        segment = int(self._generator.integers(self.filaments[filament].segments))
        fraction = self._generator.choice([0.0, 1.0, self._generator.random()])
        return self.filaments.segment_place(filament, segment=segment, fraction=float(fraction))

    def _distance(self, places):
        nodes = self._positions._value
        first, second = ((1 - p.fraction) * nodes[p.first] + p.fraction * nodes[p.second] for p in places)
        difference = np.array(second - first)
        if self._box is not None:
            difference -= np.round(difference @ np.linalg.inv(self._box)) @ self._box
        return np.linalg.norm(difference)

    def _add_wall(self):
        if self._generator.random() < 0.2:
            center = np.full(3, self._edge / 2)
            distances = np.linalg.norm(np.array(self._positions._value) - center, axis=1)
            sphere = Sphere(center, 0.97 * distances.max())
            stiffness = PICONEWTON_PER_NANOMETER * 10 ** self._generator.uniform(-2, 1)
            self._add(filament_wall_force(self.filaments, self.system, sphere, stiffness), 3)
