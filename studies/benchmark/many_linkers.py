"""What many linkers cost: 100 000 of them on 10 000 segments, beside the mechanics of the same network.

Filaments of the contractile bundle at random in a periodic box, with as many motors as crosslinkers (see
``kinetic_systems``). One hand of each stays bound, the other one binds what is around and unbinds five times a second:
the number of those that hold with both hands soon changes slowly. Then three systems begin from there, each time that
they are timed: that with its linkers; the same filaments with springs that stay where those of linkers are, which is
the mechanics; and filaments alone. Kinetics is what the first takes beyond the second. Memory is by how much more a
fresh process grows with all linkers than with a hundredth of them, so that cells and equations, which are there once,
do not count.
"""

import sys
from dataclasses import dataclass, replace

import numpy as np

from openmm_cylchain import Crosslinks, Filaments

from .kinetic_systems import ACTIN, MILLISECOND, TEMPERATURE, VISCOSITY, BundleSystem
from .kinetic_systems import linker_types as bundle_types
from .measurement import Estimate, median, ratio, scaled
from .memory import MeasurementError, measure_in_process, print_growth
from .report import row
from .systems import Network, one_thread_context, restarting

STEP = 2.0
"""In ms."""

UNBINDING_RATE = 5e-12
"""Of second hands, in 1/ps."""

_SEED = 1
_STEPS = 3
"""Before memory is looked at."""


@dataclass(frozen=True)
class NetworkSystem:
    """Filaments at random in a periodic box, with linkers.

    Attributes
    ----------
    filaments, segments : int
        The second, of each filament.
    linkers : int
        Half of them motors, half of them crosslinkers.
    edge : float
        Of the box, in nm.
    steps : int
        From linkers with one hand bound to those that are timed.
    """

    filaments: int = 500
    segments: int = 20
    linkers: int = 100_000
    edge: float = 3000.0
    steps: int = 300


class LinkedNetwork(Network):
    """Such filaments in a Context, with linkers, with springs that stay, or alone."""

    def positions(self):
        """Of all nodes, in nm."""
        return self.context.getState(positions=True).getPositions(asNumpy=True)._value

    def springs(self, linker_type):
        """The pairs of places that linkers of a type join: a list of pairs of SegmentPlaces."""
        table = self.filaments.in_context(self.context).linkers()
        joining = (table.held == 2) & (table.types == linker_type)
        return [
            [self.filaments.segment_place(number, arc_length=along) for number, along in zip(*own)]
            for own in zip(table.filaments[joining].tolist(), table.arc_lengths[joining].tolist())
        ]


def linker_types():
    """The Crosslinkers: motors and crosslinkers of the bundle whose first hands stay, and second ones come and go."""
    types = []
    for kind in bundle_types(BundleSystem()):
        first = replace(kind.hands[0], binding_rate=0.0, unbinding_rate=0.0, at_end="hold")
        types.append(replace(kind, hands=(first, replace(kind.hands[0], unbinding_rate=UNBINDING_RATE))))
    return types


def create_network(system, linkers=0, springs=None, positions=None):
    """Filaments in a Context on one thread.

    Parameters
    ----------
    system : NetworkSystem
    linkers : int
        How many bind to them, each with one hand bound.
    springs : sequence of lists, optional
        For each type of linkers, the pairs of places that springs join which stay.
    positions : (nodes, 3) array, optional
        In nm; straight filaments at random if not given.
    """
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(_SEED)
    for _ in range(system.filaments):
        direction = generator.normal(size=3)
        start = generator.uniform(0.0, system.edge, 3)
        filaments.add_straight(ACTIN, system.segments, start, direction / np.linalg.norm(direction))
    if linkers:
        for kind, count in zip(linker_types(), (linkers // 2, linkers - linkers // 2)):
            filaments.add_linkers(kind, count, bound=count, seed=_SEED)
    _, openmm_system, drawn = filaments.build(box_vectors=system.edge * np.eye(3))
    for kind, pairs in zip(linker_types(), springs or ()):
        links = Crosslinks(stiffness=kind.stiffness, rest_length=kind.rest_length)
        links.add_many(None, pairs)
        links.add_to(openmm_system, periodic=True)
    integrator = filaments.create_integrator(openmm_system, STEP * MILLISECOND, random_seed=_SEED, checks=False)
    nodes = drawn._value if positions is None else positions
    return LinkedNetwork(filaments, one_thread_context(openmm_system, integrator, nodes))


def linked_networks(system):
    """Three networks from one moment on: with its linkers, with springs that stay, and filaments alone; and how many.

    Returns
    -------
    dict of str to Network
    int
        The number of linkers that hold with both hands.
    """
    network = create_network(system, system.linkers)
    network.advance(system.steps)
    positions = network.positions()
    springs = [network.springs(number) for number in range(len(network.filaments.linkers))]
    networks = {
        "with_linkers": network,
        "with_springs": create_network(system, springs=springs, positions=positions),
        "alone": create_network(system, positions=positions),
    }
    return networks, sum(map(len, springs))


def linker_cases(networks):
    """What is timed, a list of Cases that begin from the same state each time."""
    return [restarting(_case(name), network) for name, network in networks.items()]


def linker_rows(times, joined):
    """Rows of the times of a step, of kinetics and its share of mechanics, and of how many linkers hold both hands.

    Parameters
    ----------
    times : dict
        Seconds per step, one for each repetition, by the names of cases.
    joined : int
    """
    steps = {name: np.asarray(times[_case(name)]) for name in ("with_linkers", "with_springs", "alone")}
    rows = [row(f"time_per_step_{_case(name)}", scaled(median(own), 1e3), "ms") for name, own in steps.items()]
    kinetics = median(steps["with_linkers"] - steps["with_springs"])
    rows.append(row("time_per_step_kinetics_of_many_linkers", scaled(kinetics, 1e3), "ms"))
    whole = ratio(steps["with_linkers"], steps["with_springs"])
    rows.append(row("kinetics_over_mechanics_of_many_linkers", Estimate(whole.value - 1.0, whole.error), "1"))
    rows.append(row("linkers_with_both_hands_bound_of_many_linkers", Estimate(float(joined), None), "linkers"))
    return rows


def _case(name):
    return f"many_linkers_{name}"


def bytes_per_linker(system):
    """By how much a process grows for each linker, in bytes.

    Raises
    ------
    MeasurementError
        If a process fails, or memory cannot be measured on this operating system.
    """
    numbers = (str(system.filaments), str(system.segments), repr(system.edge))
    counts = (system.linkers, system.linkers // 100)
    many, few = (measure_in_process(__name__, *numbers, str(count))["resident"] for count in counts)
    return (many - few) / (counts[0] - counts[1])


def _grow(filaments, segments, edge, linkers):
    def make():
        network = create_network(NetworkSystem(int(filaments), int(segments), edge=float(edge)), int(linkers))
        network.advance(_STEPS)
        return network

    print_growth(make)


if __name__ == "__main__":
    try:
        _grow(*sys.argv[1:])
    except MeasurementError as error:
        sys.exit(str(error))
