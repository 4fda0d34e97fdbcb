"""The shear modulus of networks in a plane: of filaments in so many elements, and of continuous ones.

In a random network, filaments of one length lie anywhere. In a lattice of triangles, from which spans are missing,
filaments are the straight rows of those that are left. Where filaments meet, links without a rest length join them,
which are hinges. Two lines across the network are held wherever filaments cross them, and one of them is moved along
itself by a small strain. The force on it, over its length and the strain, is the modulus.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import spsolve

from openmm_cylchain import Crosslinks
from openmm_cylchain.couplings.beam_curves import BeamCurves

from . import rods_on_string, simulation
from .rods_on_string import ACTIN, MICROMETER

LENGTH = 2.0 * MICROMETER
"""Of a filament, in nm."""
WIDTH, FILAMENTS = 3.0 * MICROMETER, 40
"""Of the square in which the middles of filaments are, and how many there are."""
SPAN, SITES, PRESENT = 0.2 * MICROMETER, 10, 0.62
"""Of the lattice: the length of a span, sites along each side, and the share of spans that there is. Two thirds would
hold the lattice without bends."""
STIFFNESS = 1.0
"""Of links, and of what holds the lines, in kJ/(mol nm^2)."""
STRAIN = 1e-5
_WIDTH_OF_DIFFERENCE = 1e-3
_LINES = (0.1, 0.9)
_NOWHERE = 1e-4
"""What holds each unknown, over EI/L^3: filaments that nothing holds would be anywhere."""


@dataclass(frozen=True)
class Network:
    """Filaments in a plane and what joins them.

    Attributes
    ----------
    starts, directions : (n, 2) arrays
        In nm, and unit vectors.
    lengths : (n,) array
        In units.
    unit : float
        In nm.
    height : float
        Of one line above the other, in nm.
    links : list of (int, float, int, float)
        Filaments and arc lengths of the two places, in nm.
    held : list of (int, float, bool)
        A filament, an arc length, and whether the line is the one that is moved.
    """

    starts: np.ndarray
    directions: np.ndarray
    lengths: np.ndarray
    unit: float
    height: float
    links: list
    held: list

    @property
    def spans(self):
        """The mean number of spans of a filament between places that are joined or held."""
        return (2 * len(self.links) + len(self.held)) / len(self.starts) + 1

    @property
    def shift(self):
        """How far the line is moved, in nm."""
        return STRAIN * self.height

    @classmethod
    def of_kind(cls, kind, seed):
        """One that is "random" or a "lattice"."""
        return cls.draw_random(seed) if kind == "random" else cls.draw_lattice(seed)

    @classmethod
    def draw_random(cls, seed):
        """Filaments that lie anywhere."""
        generator = np.random.default_rng(seed)
        angles = generator.uniform(0.0, np.pi, FILAMENTS)
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        starts = generator.uniform(0.0, WIDTH, (FILAMENTS, 2)) - 0.5 * LENGTH * directions
        links = []
        for i in range(FILAMENTS):
            for j in range(i + 1, FILAMENTS):
                places = np.linalg.solve(np.stack([directions[i], -directions[j]], axis=1), starts[j] - starts[i])
                if np.all((places > 0.0) & (places < LENGTH)):
                    links.append((i, float(places[0]), j, float(places[1])))
        held = []
        for line in _LINES:
            places = (line * WIDTH - starts[:, 1]) / directions[:, 1]
            for i in np.flatnonzero((places > 0.0) & (places < LENGTH)):
                held.append((int(i), float(places[i]), line == _LINES[-1]))
        height = (_LINES[1] - _LINES[0]) * WIDTH
        return cls(starts, directions, np.ones(FILAMENTS, dtype=int), LENGTH, height, links, held)

    @classmethod
    def draw_lattice(cls, seed):
        """Rows of spans in a lattice of triangles, some of which are missing."""
        generator = np.random.default_rng(seed)
        height = 0.5 * np.sqrt(3.0) * SPAN
        # Steps along the three directions, by site and row.
        steps = np.array([[1, 0], [0, 1], [-1, 1]])
        axes = np.array([[SPAN, 0.0], [0.5 * SPAN, height]])
        starts, directions, lengths, at_site = [], [], [], {}
        for step in steps:
            for site in np.ndindex(SITES, SITES):
                if min(np.array(site) - step) >= 0 and max(np.array(site) - step) < SITES:
                    continue
                # A whole line of the lattice, from its first site on.
                line = [np.array(site)]
                while min(line[-1] + step) >= 0 and max(line[-1] + step) < SITES:
                    line.append(line[-1] + step)
                present = generator.random(len(line) - 1) < PRESENT
                begin = 0
                while begin < len(present):
                    end = begin
                    while end < len(present) and present[end]:
                        end += 1
                    if end > begin:
                        for number in range(begin, end + 1):
                            own = (len(starts), (number - begin) * SPAN)
                            at_site.setdefault(tuple(line[number].tolist()), []).append(own)
                        starts.append(line[begin] @ axes)
                        directions.append(step @ axes / SPAN)
                        lengths.append(end - begin)
                    begin = end + 1
        links, held = [], []
        for (_, row), places in sorted(at_site.items()):
            links += [(*first, *second) for first, second in zip(places, places[1:])]
            if row in (0, SITES - 1):
                held += [(*place, row > 0) for place in places]
        return cls(np.array(starts), np.array(directions), np.array(lengths), SPAN, (SITES - 1) * height, links, held)

    def place(self, filament, arc_length):
        """Where a place is at rest, (2,) in nm."""
        return self.starts[filament] + arc_length * self.directions[filament]


def network_forces(kind, seeds, elements, element):
    """The force that it takes to shear networks, by the linear equations of the forces that the engine computes.

    Parameters
    ----------
    kind : {"random", "lattice"}
    seeds : list of int
    elements : int
        Of a filament of a random network, or of a span of a lattice.
    element : {"straight", "beam"}

    Returns
    -------
    dict of arrays
        ``force`` (networks,) in kJ/(mol nm), and the number of ``unknowns`` (networks,).
    """
    measured = {"force": [], "unknowns": []}
    for seed in seeds:
        network = Network.of_kind(kind, seed)
        column = rods_on_string.SIMULATED_ACTIN
        filaments = column.solvent(temperature=0.0)
        filament_type = column.filament_type(network.unit / elements, element=element)
        for start, direction, length in zip(network.starts, network.directions, network.lengths):
            filaments.add_straight(filament_type, int(length) * elements, [*start, 0.0], [*direction, 0.0], planar=True)
        _, system, positions = filaments.build()
        links = Crosslinks(STIFFNESS, 0.0)
        for i, s, j, t in network.links:
            links.add(None, filaments.segment_place(i, arc_length=s), filaments.segment_place(j, arc_length=t))
        moved = []
        for filament, arc_length, moves in network.held:
            point = [*network.place(filament, arc_length), 0.0]
            point[0] += network.shift if moves else 0.0
            number = links.add(None, filaments.segment_place(filament, arc_length=arc_length), point)
            if moves:
                moved.append(number)
        links.add_to(system)
        context = simulation.start(filaments, 1.0, 1, system, positions)
        solved = _solve(context, positions._value)
        context.setPositions(solved)
        measured["force"].append(_force_along(links, context, moved))
        measured["unknowns"].append(2 * len(solved))
    return {name: np.array(values, dtype=float) for name, values in measured.items()}


def _solve(context, positions):
    # One step of Newton's method, with differences of forces: all is linear.
    def forces(places):
        context.setPositions(places)
        return context.getState(forces=True).getForces(asNumpy=True)._value[:, :2].ravel()

    rows, columns, values = [], [], []
    count = 2 * len(positions)
    for unknown in range(count):
        ends = []
        for sign in (1.0, -1.0):
            moved = positions.copy()
            moved[unknown // 2, unknown % 2] += sign * _WIDTH_OF_DIFFERENCE
            ends.append(forces(moved))
        change = (ends[1] - ends[0]) / (2.0 * _WIDTH_OF_DIFFERENCE)
        present = np.flatnonzero(change)
        rows.append(present)
        columns.append(np.full(len(present), unknown))
        values.append(change[present])
    matrix = csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    matrix = 0.5 * (matrix + matrix.T) + diags_array(np.full(count, _NOWHERE * ACTIN.rigidity / LENGTH**3))
    solved = positions.copy()
    solved[:, :2] += spsolve(matrix.tocsc(), forces(positions)).reshape(-1, 2)
    return solved


def _force_along(links, context, numbers):
    # Of the links to the points of a line, along x.
    places = context.getState(positions=True).getPositions(asNumpy=True)._value
    vectors = links.table(context).displacements(places, curves=BeamCurves.of_system(context.getSystem()))
    return STIFFNESS * float(np.sum(vectors[numbers, 0]))


def continuous_force(network):
    """The force that it takes to shear a network of continuous filaments, in kJ/(mol nm).

    Between two places, a filament is a beam of Euler and Bernoulli in a plane under the forces at its ends, which is a
    cubic curve: the linear equations of all of them, and of links, are exact.
    """
    rows, columns, values, loads = [], [], [], []
    first = {}
    count = 0
    places = [{0.0, length * network.unit} for length in network.lengths]
    for i, s, j, t in network.links:
        places[i].add(s)
        places[j].add(t)
    for i, s, _ in network.held:
        places[i].add(s)

    def add(unknowns, matrix):
        for a, row in enumerate(unknowns):
            for b, column in enumerate(unknowns):
                rows.append(row)
                columns.append(column)
                values.append(matrix[a, b])

    for i, own in enumerate(places):
        ordered = sorted(own)
        for s in ordered:
            first[i, s] = count
            count += 3
        for s, t in zip(ordered, ordered[1:]):
            unknowns = [first[i, place] + k for place in (s, t) for k in range(3)]
            add(unknowns, _beam_matrix(network.directions[i], t - s))
    for i, s, j, t in network.links:
        for k in range(2):
            add([first[i, s] + k, first[j, t] + k], STIFFNESS * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    for i, s, moves in network.held:
        for k in range(2):
            add([first[i, s] + k], np.array([[STIFFNESS]]))
        if moves:
            loads.append(first[i, s])
    least = _NOWHERE * ACTIN.rigidity / LENGTH**3
    for unknown in range(count):
        add([unknown], np.array([[least * (LENGTH**2 if unknown % 3 == 2 else 1.0)]]))
    right = np.zeros(count)
    right[loads] = STIFFNESS * network.shift
    moved = spsolve(csr_array((values, (rows, columns)), shape=(count, count)).tocsc(), right)
    return STIFFNESS * float(np.sum(network.shift - moved[loads]))


def _beam_matrix(direction, length):
    # Of (x, y, angle) at both ends.
    rigidity = ACTIN.rigidity
    along, across = np.array([*direction, 0.0]), np.array([-direction[1], direction[0], 0.0])
    turn = np.array([0.0, 0.0, 1.0])
    none = np.zeros(3)
    stretch = np.concatenate([-along, along])
    ends = [np.concatenate([across, none]), np.concatenate([turn, none])]
    ends += [np.concatenate([none, across]), np.concatenate([none, turn])]
    own = np.array(ends)
    bending = (rigidity / length**3) * np.array(
        [
            [12.0, 6.0 * length, -12.0, 6.0 * length],
            [6.0 * length, 4.0 * length**2, -6.0 * length, 2.0 * length**2],
            [-12.0, -6.0 * length, 12.0, -6.0 * length],
            [6.0 * length, 2.0 * length**2, -6.0 * length, 4.0 * length**2],
        ]
    )
    return ACTIN.filament_type(LENGTH).stretching_modulus / length * np.outer(stretch, stretch) + own.T @ bending @ own
