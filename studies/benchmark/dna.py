"""DNA and chromatin: a supercoiled plasmid, and a long chain with loop extruders beside polychrom's way.

The plasmid has 10 kilobases, 25 base pairs in a segment, twist, and contacts of 5 nm, and is closed with 6 % too few
turns. It supercoils for a while, and is timed then.

The chain has 100 000 segments of 20 nm with polychrom's energies of bonds and angles, in a periodic box with a fifth of
a bead in each cube of 20 nm, and 1000 extruders. Contacts of 10 nm keep strands from passing through each other: it
begins in rows. Without contacts, it begins in equilibrium, and is timed in longer steps, too, which do not resolve how
segments turn.

In turn with it, the same chain as polychrom has it, whose package is not needed: harmonic bonds of which one k_BT is a
tenth, angles of 1.5 k_BT, a CustomNonbondedForce of 1.5 k_BT between beads that lets strands pass, a Langevin
integrator, bonds for extruders that are moved from outside after so many steps, which is timed apart and added. That
dynamics is inertial. Its time is the one in which a bead alone diffuses as far as with the friction of a segment.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np
import openmm
from openmm import unit

from openmm_cylchain import (
    Crosslinker,
    Filaments,
    FilamentType,
    Hand,
    LinkerTable,
    analysis,
    capsule_contact_force,
)
from openmm_cylchain.engine_choice import choose_engine

from .measurement import Case, describe_machine, median, scaled, time_interleaved
from .report import Report, Row, row
from .systems import Network, one_thread_context

_TEMPERATURE = 300.0
_KT = (unit.MOLAR_GAS_CONSTANT_R * _TEMPERATURE * unit.kelvin).value_in_unit(unit.kilojoule_per_mole)
_WATER, _NUCLEOPLASM = 1e-3 * unit.pascal * unit.second, 0.1 * unit.pascal * unit.second
_SEED = 1
_MICROSECOND, _SECOND = 1e6, 1e12

DNA = FilamentType(
    name="DNA",
    diameter=2.0,
    segment_length=8.5,
    persistence_length=50.0,
    twist_persistence_length=75.0,
    temperature=_TEMPERATURE,
    stretching_modulus=1100 * unit.piconewton,
)
BEAD = 20.0
"""In nm: what polychrom calls 1."""

CHROMATIN = FilamentType(
    name="CHR",
    diameter=0.5 * BEAD,
    segment_length=BEAD,
    stretching_stiffness=2.0 * _KT / (0.1 * BEAD) ** 2,
    bending_rigidity=1.5 * _KT * BEAD,
    bending_model="quadratic",
    friction_length=10.0 * BEAD,
)
_NUCLEOTIDES_OF_TURN, _BASE_PAIR, _DENSITY = 10.5, 0.34, -0.06

MASS, COLLISION_RATE, LANGEVIN_STEP = 100.0 / BEAD**2, 0.01, 0.08
"""Of polychrom's beads: 100 Da where 1 is a nanometer; per ps, and ps."""

STEPS_OF_MOVE = 750
"""Of the Langevin integrator, between moves of extruders."""


@dataclass(frozen=True)
class DnaEffort:
    """How much is measured.

    Attributes
    ----------
    plasmid : int
        Segments.
    chain, extruders : int
    settling : int
        Steps of the plasmid, of 10 ns, before it is timed.
    steps : tuple of float
        Of the chain without contacts, in us.
    repetitions : int
    seconds : float
        Of timing in each repetition.
    """

    plasmid: int
    chain: int
    extruders: int
    settling: int
    steps: tuple
    repetitions: int
    seconds: float


FULL = DnaEffort(400, 100_000, 1000, 20_000, (1.0, 10.0), 5, 2.0)
QUICK = DnaEffort(400, 20_000, 200, 200, (1.0, 10.0), 2, 0.5)
_SETTLING_STEP, _CHAIN_SETTLING = 1e4, 20


def create_plasmid(segments):
    """A ring, flat, with all missing turns in its twist, a Network on one thread; and the turns."""
    filaments = Filaments(_WATER, _TEMPERATURE, engine="compiled")
    filaments.add_ring(DNA, segments, [0.0, 0.0, 0.0])
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, 5.0))
    integrator = filaments.create_integrator(system, _SETTLING_STEP, random_seed=_SEED, checks=False)
    plasmid = Network(filaments, one_thread_context(system, integrator, positions._value))
    turns = _DENSITY * segments * DNA.segment_length / _BASE_PAIR / _NUCLEOTIDES_OF_TURN
    filaments.in_context(plasmid.context).set_twists(0, np.full(segments, 2.0 * np.pi * turns / segments))
    return plasmid, turns


def rows_in_a_box(segments):
    """Places of the nodes of a chain that fills a box in rows, two segments apart, and the edge of the box, in nm."""
    length = round(1.3 * segments ** (1.0 / 3.0))
    rows = math.ceil(math.sqrt(segments / (length + 2)))
    steps, along, across, row_number = [], 1.0, 1.0, 0
    while len(steps) < segments:
        steps += [[along, 0.0, 0.0]] * length
        along = -along
        if 0 <= row_number + across < rows:
            row_number += across
            steps += [[0.0, across, 0.0]] * 2
        else:
            across = -across
            steps += [[0.0, 0.0, 1.0]] * 2
    nodes = BEAD * np.concatenate([np.zeros((1, 3)), np.cumsum(steps[:segments], axis=0)])
    return nodes, float(np.ptp(nodes, axis=0).max()) + 2.0 * BEAD


def create_chain(segments, extruders, contacts):
    """A chain of chromatin with extruders that have just loaded, a Network on one thread."""
    nodes, edge = rows_in_a_box(segments)
    filaments = Filaments(_NUCLEOPLASM, _TEMPERATURE, engine="compiled")
    if contacts:
        filaments.add_nodes(CHROMATIN, nodes)
    else:
        filaments.add_equilibrium(CHROMATIN, segments, seed=_SEED)
    hand = Hand(
        binding_rate=1 / unit.second,
        reach=3.0 * BEAD,
        unbinding_rate=0.01 / unit.second,
        speed=300 * unit.nanometer / unit.second,
        stall_force=0.2 * unit.piconewton,
    )
    extruder = Crosslinker(
        hands=[replace(hand, speed=-hand.speed), hand],
        stiffness=0.005 * unit.piconewton / unit.nanometer,
        rest_length=1.5 * BEAD,
        loading_distance=BEAD,
        name="extruder",
    )
    filaments.add_linkers(extruder, extruders, volume=edge**3, seed=_SEED)
    _, system, positions = filaments.build(box_vectors=edge * np.eye(3))
    if contacts:
        system.addForce(capsule_contact_force(filaments, system, 0.5 * BEAD))
    integrator = filaments.create_integrator(system, _MICROSECOND, random_seed=_SEED, checks=False)
    chain = Network(filaments, one_thread_context(system, integrator, positions._value))
    first = BEAD * _loaded(segments, extruders)
    numbers, none = np.arange(extruders), np.zeros(extruders, dtype=int)
    table = LinkerTable(
        numbers, none, none - 1, np.zeros((extruders, 2), dtype=int), np.stack([first, first + BEAD], axis=1), extruders
    )
    filaments.in_context(chain.context).set_linkers(table)
    return chain


def _loaded(segments, extruders):
    return np.sort(np.random.default_rng(_SEED).integers(10, segments - 10, extruders))


class BeadsOfPolychrom:
    """The same chain with forces and an integrator of OpenMM alone, on one thread."""

    def __init__(self, segments, extruders):
        nodes, edge = rows_in_a_box(segments)
        beads = len(nodes)
        system = openmm.System()
        for _ in range(beads):
            system.addParticle(MASS)
        system.setDefaultPeriodicBoxVectors(*(edge * np.eye(3)))
        angles = openmm.HarmonicAngleForce()
        for bead in range(beads - 2):
            angles.addAngle(bead, bead + 1, bead + 2, np.pi, 1.5 * _KT)
        repulsion = openmm.CustomNonbondedForce("height*(1 + x^6*(x - 1)*7^7/6^6); x = (r/range)^2*6/7")
        repulsion.addGlobalParameter("height", 1.5 * _KT)
        repulsion.addGlobalParameter("range", 1.05 * BEAD)
        repulsion.setNonbondedMethod(repulsion.CutoffPeriodic)
        repulsion.setCutoffDistance(1.05 * BEAD)
        for _ in range(beads):
            repulsion.addParticle([])
        self._bonds = openmm.HarmonicBondForce()
        for bead in range(beads - 1):
            self._bonds.addBond(bead, bead + 1, BEAD, CHROMATIN.segment_stiffness)
            repulsion.addExclusion(bead, bead + 1)
        # Of two successive places, between which bonds of extruders are moved.
        first = _loaded(segments, extruders)
        self._places = [np.stack([first - one, first + 2 + one], axis=1).tolist() for one in (0, 1)]
        self._first, self._now = self._bonds.getNumBonds(), 0
        for place, held in zip(self._places, (True, False)):
            for pair in place:
                self._bonds.addBond(*pair, *self._extruder(held))
        for force in (self._bonds, angles, repulsion):
            system.addForce(force)
        integrator = openmm.LangevinMiddleIntegrator(_TEMPERATURE, COLLISION_RATE, LANGEVIN_STEP)
        integrator.setRandomNumberSeed(_SEED)
        self.context = one_thread_context(system, integrator, nodes)
        self.context.setVelocitiesToTemperature(_TEMPERATURE, _SEED)

    @staticmethod
    def _extruder(held):
        return 0.5 * BEAD, 2.0 * _KT / (0.2 * BEAD) ** 2 if held else 0.0

    def advance(self, steps):
        """Take steps."""
        self.context.getIntegrator().step(steps)

    def move(self, times):
        """Move all extruders so many times."""
        for _ in range(times):
            self._now = 1 - self._now
            for number, place in enumerate(self._places):
                start = self._first + number * len(place)
                for bond, pair in enumerate(place, start):
                    self._bonds.setBondParameters(bond, *pair, *self._extruder(number == self._now))
            self._bonds.updateParametersInContext(self.context)


def brownian_time():
    """The time, in ps, in which a bead with the mean friction of a segment diffuses as far as one does in a step."""
    friction = CHROMATIN.segment_friction(_NUCLEOPLASM, _TEMPERATURE)
    mean = (friction.parallel + 2.0 * friction.perpendicular) / 3.0
    return LANGEVIN_STEP * mean / (MASS * COLLISION_RATE)


def benchmark_dna(effort=FULL, say=lambda message: None):
    """Measure the speed of a supercoiled plasmid, and of a long chain with extruders beside polychrom's way.

    Parameters
    ----------
    effort : DnaEffort
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If there is no compiled engine.
    """
    choose_engine("compiled")
    machine = describe_machine()
    say("supercoiling")
    plasmid, turns = create_plasmid(effort.plasmid)
    plasmid.advance(effort.settling)
    nodes = plasmid.context.getState(positions=True).getPositions(asNumpy=True)._value
    writhe = analysis.writhe(nodes[plasmid.filaments.node_indices[0]])
    say(f"a chain of {effort.chain} segments")
    chain, without_contacts = (create_chain(effort.chain, effort.extruders, contacts) for contacts in (True, False))
    beads = BeadsOfPolychrom(effort.chain, effort.extruders)
    recommended = {
        name: float(own.filaments.recommended_time_step(system=own.context.getSystem()).step)
        for name, own in (("plasmid", plasmid), ("chain", chain))
    }
    chain.context.getIntegrator().setStepSize(recommended["chain"])
    for own in (chain, without_contacts, beads):
        own.advance(_CHAIN_SETTLING)
    measured = {
        "plasmid": (plasmid, recommended["plasmid"]),
        "plasmid_10_ns": (plasmid, _SETTLING_STEP),
        "chain": (chain, recommended["chain"]),
    }
    for step in effort.steps:
        measured[f"chain_without_contacts_{step:g}_us"] = without_contacts, step * _MICROSECOND
    cases = [_case(name, network, step) for name, (network, step) in measured.items()]
    cases += [Case("polychrom", beads.advance), Case("moves", beads.move)]
    times = time_interleaved(cases, effort.repetitions, effort.seconds, say, clock=time.process_time)
    rows = speed_rows({name: step for name, (_, step) in measured.items()}, times)
    rows += [Row(f"recommended_step_{name}", step / _MICROSECOND, None, "us") for name, step in recommended.items()]
    rows += [Row("missing_turns_plasmid", -turns, None, "1"), Row("writhe_plasmid", writhe, None, "1")]
    settings = {
        "segments_of_plasmid": effort.plasmid,
        "settling_ns": effort.settling * _SETTLING_STEP * 1e-3,
        "segments_of_chain": effort.chain,
        "extruders": effort.extruders,
        "viscosity_of_chain_Pa_s": 0.1,
        "steps_between_moves": STEPS_OF_MOVE,
        "threads": 1,
        "clock": "processor",
    }
    title = (
        f"A plasmid of {effort.plasmid} segments, and a chain of {effort.chain} segments with {effort.extruders} "
        "extruders, one thread"
    )
    return Report(title, machine, settings, rows, {})


def _case(name, network, step):
    def advance(steps):
        network.context.getIntegrator().setStepSize(step)
        network.advance(steps)

    return Case(name, advance)


def speed_rows(lengths, times):
    """Rows of times per step and of what is simulated in a second.

    Parameters
    ----------
    lengths : dict of str to float
        Steps in ps by the names of cases.
    times : dict
        Seconds per step, one for each repetition, by the names of cases, with "polychrom" and "moves".
    """
    seconds = {name: np.asarray(times[name]) for name in lengths}
    seconds["polychrom"] = np.asarray(times["polychrom"]) + np.asarray(times["moves"]) / STEPS_OF_MOVE
    rows = []
    for name, step in {**lengths, "polychrom": brownian_time()}.items():
        speed = median(step / _SECOND / seconds[name])
        rows.append(row(f"simulated_seconds_per_second_{name}", speed, "s/s"))
        rows.append(row(f"time_per_step_{name}", scaled(median(seconds[name]), 1e3), "ms"))
    rows.append(row("time_per_move_polychrom", scaled(median(times["moves"]), 1e3), "ms"))
    return rows
