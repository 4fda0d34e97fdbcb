"""A run as one object: times, filaments, linkers, energies; for mdtraj and MDAnalysis."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import mdtraj
import numpy as np
import numpy.typing as npt

from ..couplings.beam_curves import BeamCurves
from ..couplings.contact_frames import ContactFrame, DescribedContactFinder, joined_contacts
from ..couplings.crosslink_records import CROSSLINK_RECORD, CrosslinkFrame, crosslinks_at
from ..couplings.shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Shape, Slab, Sphere, Torus
from ..errors import InputError, PrecisionWarning
from ..filaments.grown import GrownChain
from ..filaments.twist import has_twist
from ..mechanics.material_frames import material_vectors
from ..output.dcd_frames import DCDFrames
from ..output.linker_records import LINKER_RECORD
from ..output.read_tables import read_growth, read_reports
from ..output.record_file import read_records
from ..output.run_description import DescribedLinkers, RunDescription
from ..output.run_files import RunFiles
from ..output.run_tables import MILLISECOND
from ..units.quantities import VOLUME, numbers_of, positive, shown, thermal_energy, whole_number
from ..units.types import FloatArray, Indices, IntArray, Scalar
from .run_filaments import PIECES_OF_ELEMENT, RunParticles, chain_of, described_filament
from .run_topology import read_topology

_COARSE = 0.2
_NONE = np.zeros((0, 3))
_SHAPES = {
    "plane": lambda point, vector, length: Plane(point, vector),
    "slab": Slab,
    "sphere": lambda point, vector, length: Sphere(point, length),
    "cylinder": Cylinder,
    "capsule": lambda point, vector, length: Capsule(point, vector, 2.0 * float(np.linalg.norm(vector)), length),
    "torus": lambda point, vector, length: Torus(point, vector, float(np.linalg.norm(vector)), length),
    "box": lambda point, vector, length: Box(point, vector),
    "ellipsoid": lambda point, vector, length: Ellipsoid(point, vector),
}


@dataclass(frozen=True)
class RunStage:
    """A stage of a run: its name, when it begins in ps, and the numbers of its frames, but for that at its begin."""

    name: str
    begin: float
    frames: range


class Run:
    """A run that has been simulated into a directory; ``load`` makes it.

    Positions are those of the trajectory, in single precision, and are read when they are asked for. Filaments are
    whole: nothing is wrapped into a periodic box.

    Attributes
    ----------
    path : Path
    title : str
    temperature : float
        In K.
    time_step : float
        In ps.
    times : (frames,) array
        Of the frames, in ps, in double precision.
    steps : (frames,) int array
    box : (3, 3) array or None
        Vectors of a periodic box in nm.
    filaments : tuple of RunFilament
    particles : tuple of RunParticles
        Beside filaments; each with one name and diameter.
    linker_types : tuple
        Of the kinds of linkers, with ``name``, ``stiffness`` in kJ/(mol nm^2) and ``rest_length`` in nm.
    walls : tuple of Shape
        Those of ``filament_wall_force``, and those that a ``RunReporter`` was given.
    energies : dict of (frames,) arrays
        By the headers of ``energies.csv``.
    complete : bool
        Whether the run has come to its end. True for one of a ``RunReporter``, which does not know.
    """

    def __init__(self, files: RunFiles, description: RunDescription, frames: int, energies: dict[str, Any]) -> None:
        self._files = files
        self._description = description
        self._dcd = DCDFrames(files.trajectory)
        self.path = files.path
        self.title = description.title
        self.temperature = description.temperature
        self.time_step = description.time_step
        self.steps: IntArray = energies["step"][:frames].astype(int)
        self.times: FloatArray = MILLISECOND * energies["time (ms)"][:frames]
        self.energies: dict[str, FloatArray] = {name: values[:frames] for name, values in energies.items()}
        self.box: FloatArray | None = None if description.box is None else np.array(description.box)
        self.filaments = tuple(described_filament(own) for own in description.filaments)
        self.particles = tuple(
            RunParticles(own.name, np.array(own.particles, dtype=int), own.diameter) for own in description.others
        )
        self.linker_types: tuple[DescribedLinkers, ...] = description.linkers
        self.walls: tuple[Shape, ...] = tuple(
            _SHAPES[own.shape](own.point, own.vector, own.length) for own in description.walls
        )
        self.complete = description.frames in (None, frames)
        self._found_contacts_of: tuple[tuple[int, ...] | None, list[DescribedContactFinder]] = None, []

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.times)

    def __repr__(self) -> str:
        kinds = f"{len(self.filaments)} filaments" + (", linkers" if self.linker_types else "")
        return f"<Run {self.path}: {len(self)} frames, {kinds}>"

    def positions(self, frame: int) -> FloatArray:
        """Positions (particles, 3) in nm of a frame; a negative one counts from the end."""
        return self._dcd.positions(self._frame(frame))

    def _frame(self, frame):
        if isinstance(frame, bool) or not isinstance(frame, (int, np.integer)) or not -len(self) <= frame < len(self):
            raise InputError(f"The run in {self.path} has the frames 0 to {len(self) - 1}, but not {shown(frame)}.")
        return int(frame) % len(self)

    @cached_property
    def linkers(self) -> list[npt.NDArray[Any]]:
        """Linkers with a hand that is bound: for each frame an array of records.

        Fields: ``number``, ``type`` (in ``linker_types``), ``anchor``, ``filaments``, ``arc_lengths``, ``places``
        (2, 3) in nm and ``tension`` in kJ/(mol nm), as those of ``LinkerReporter``. Empty without linkers.
        """
        if not self.linker_types:
            return [np.zeros(0, LINKER_RECORD)] * len(self)
        records = read_records(self._files.linker_places)
        begins, ends = (np.searchsorted(records["step"], self.steps, side) for side in ("left", "right"))
        return [records[begin:end] for begin, end in zip(begins, ends)]

    @cached_property
    def linker_table(self) -> dict[str, FloatArray]:
        """Numbers and tensions of linkers: (frames, types) arrays by the headers of ``linkers.csv``."""
        if not self.linker_types:
            return {}
        table = read_reports(self._files.linkers, len(self.linker_types))
        return {name: values[: len(self)] for name, values in table.items()}

    @cached_property
    def pulling(self) -> dict[str, FloatArray]:
        """Points, forces and extensions of tethers that move: (frames, tethers) arrays by the headers of
        ``pulling.csv``, empty without such."""
        return self._by_frame(self._files.pulling)

    @cached_property
    def twist(self) -> dict[str, FloatArray]:
        """Twist and torque of filaments with end frames: (frames, such filaments) arrays by the headers of
        ``twist.csv``, empty without such."""
        return self._by_frame(self._files.twist)

    @cached_property
    def _twist_records(self):
        return read_records(self._files.twists)

    def twists(self, frame: int) -> list[FloatArray]:
        """Twists in radians of each filament in a frame, as ``FilamentsInContext.twists`` has them: none of one
        without twist."""
        frame = self._frame(frame)
        counts = [
            len(own.nodes) + (own.ring and own.bent_at_rest) if has_twist(own.type) else 0 for own in self.filaments
        ]
        if not any(counts):
            return [np.zeros(0)] * len(counts)
        record = self._twist_records[np.searchsorted(self._twist_records["step"], self.steps[frame])]
        return np.split(np.array(record["twists"]), np.cumsum(counts)[:-1])

    def material_frames(self, frame: int) -> list[FloatArray]:
        """Unit vectors (segments, 3) across the segments of each filament in a frame that turn with the material:
        none of a filament without twist. They are those of a filament that is not twisted at rest. That of the first
        segment begins anywhere."""
        return [
            material_vectors(nodes, own.ring, twists, own.type.rest_twist) if len(twists) * len(nodes) else _NONE
            for own, nodes, twists in zip(self.filaments, self.nodes(frame), self.twists(frame))
        ]

    @cached_property
    def growth(self) -> dict[str, FloatArray]:
        """How far filaments have grown: (frames, filaments that grow) arrays by the headers of ``growth.csv``, empty
        without such."""
        table = read_growth(self._files.growth) if self._files.growth.exists() else {}
        return {name: values[: len(self)] for name, values in table.items()}

    @cached_property
    def wall_forces(self) -> dict[str, FloatArray]:
        """Forces of walls, means over the steps between frames: (frames, faces of all walls) arrays by the headers of
        ``wall_forces.csv``, empty without walls."""
        return self._by_frame(self._files.wall_forces)

    @cached_property
    def contact_forces(self) -> dict[str, FloatArray]:
        """Forces of contacts, means over the steps between frames: (frames, filaments) arrays by the headers of
        ``contact_forces.csv``, empty without contacts."""
        return self._by_frame(self._files.contact_forces)

    def _by_frame(self, path):
        table = read_reports(path) if path.exists() else {}
        return {name: values[: len(self)] for name, values in table.items()}

    @cached_property
    def _crosslink_records(self):
        path = self._files.crosslinks
        return read_records(path) if path.exists() else np.zeros(0, CROSSLINK_RECORD)

    def crosslinks(self, frame: int) -> CrosslinkFrame:
        """Crosslinks of a frame, of ``Crosslinks`` or ``[[link]]``: none if there are no such.

        Returns
        -------
        CrosslinkFrame
            With ``numbers``, ``places`` (n, 2, 3) in nm, ``tensions`` in kJ/(mol nm) and ``active``, arrays.
        """
        frame = self._frame(frame)
        if not len(self._crosslink_records):
            return crosslinks_at(self._crosslink_records, 0, np.zeros((0, 3)), None)
        return crosslinks_at(
            self._crosslink_records, int(self.steps[frame]), self.positions(frame), self.box, self._beam_curves
        )

    @cached_property
    def _beam_curves(self):
        chains = [(own.nodes, own.control_points, own.ring) for own in self.filaments if len(own.control_points)]
        return BeamCurves(chains, self._description.particles) if chains else None

    def _make_contact_finders(self, nodes):
        own = self._description
        present = {filament.nodes: tuple(live.tolist()) for filament, live in zip(own.filaments, nodes)}
        filaments = {live: (number, 1) for number, live in enumerate(present.values())}
        for contacts in own.contacts:
            for particles, *_ in contacts.chains:
                # Beads of beam elements come behind the nodes of their filament, and before those of the next one.
                before = [i for i, one in enumerate(own.filaments) if one.nodes[0] < particles[0]]
                if particles not in filaments and before:
                    number = max(before, key=lambda i: own.filaments[i].nodes[0])
                    ends = 0 if own.filaments[number].ring else 1
                    filaments[particles] = number, (len(particles) - ends) // (len(own.filaments[number].nodes) - ends)
                    if not len(nodes[number]):
                        present[particles] = ()
        there = [
            replace(one, chains=tuple((present.get(chain[0], chain[0]), *chain[1:]) for chain in one.chains))
            for one in own.contacts
        ]
        return [DescribedContactFinder(contacts, filaments, own.particles, self.box) for contacts in there]

    def points(self, frame: int) -> FloatArray:
        """Positions (points, 3) in nm of what there is in a frame: points along filaments, and other particles.

        Of a frame without any of these, positions of the particles of filaments that are not there.
        """
        positions = self.positions(frame)
        there = np.concatenate([*self.curves(frame), *(positions[own.indices] for own in self.particles)])
        return there if len(there) else positions

    def contacts(self, frame: int) -> ContactFrame:
        """Contacts of a frame, of all ``capsule_contact_force`` or ``[contacts]``: none if there is no such.

        They are found anew, at positions in single precision.

        Returns
        -------
        ContactFrame
            With ``filaments``, ``segments``, ``fractions``, ``gaps``, ``forces``, ``directions``, ``distances``.

        Raises
        ------
        InputError
            If the compiled engine is missing.
        """
        positions, nodes = self.positions(frame), self._nodes_in(frame)
        counts = tuple(map(len, nodes))
        if counts != self._found_contacts_of[0]:
            # Those of filaments that grow change.
            self._found_contacts_of = counts, self._make_contact_finders(nodes)
        return joined_contacts([finder.find(positions) for finder in self._found_contacts_of[1]])

    @property
    def spring_names(self) -> list[str]:
        """Names of all kinds of springs between filaments: of linkers, and "crosslink" if there are such."""
        names = [own.name for own in self.linker_types]
        return [*names, "crosslink"] if np.any(self._crosslink_records["number"] >= 0) else names

    def springs(self, frame: int, kind: int) -> tuple[FloatArray, FloatArray]:
        """Springs of a kind in ``spring_names``: lines (n, 2, 3) between places, and where hands hold (m, 3), in nm.

        Crosslinks that are off are left out.
        """
        names = self.spring_names
        if whole_number(kind, 0, "kind") >= max(1, len(names)):
            raise InputError(f"kind must be that of one of the springs {', '.join(names) or '(none)'}, but is {kind}.")
        if kind == len(self.linker_types):
            found = self.crosslinks(frame)
            lines = found.places[found.active]
            return lines, lines.reshape(-1, 3)
        records = self.linkers[self._frame(frame)]
        places = np.asarray(records["places"][records["type"] == kind], dtype=float)
        there = ~np.isnan(places).any(axis=2)
        return places[there.all(axis=1)], places[there]

    @cached_property
    def coordinate_resolution(self) -> float:
        """Distance in nm of the numbers that positions are rounded to in the trajectory, at its largest coordinate."""
        largest = max(np.abs(self.positions(frame)).max() for frame in (0, -1))
        return 0.1 * float(np.spacing(np.float32(10.0 * largest)))

    def warn_of_rounding(self) -> None:
        """Warn (PrecisionWarning) of positions that are coarser than thermal fluctuations, see ``load``."""
        widths = [np.sqrt(thermal_energy(self.temperature) / own.type.segment_stiffness) for own in self.filaments]
        if self.coordinate_resolution > _COARSE * min(widths, default=np.inf):
            warnings.warn(
                f"Positions in {self._files.trajectory} are rounded to {self.coordinate_resolution:.2g} nm, for they "
                f"are far from the origin, but lengths of segments fluctuate by {min(widths):.2g} nm: shapes that are "
                "computed from them are wrong. Energies in energies.csv are right. Simulate nearer to the origin.",
                PrecisionWarning,
                stacklevel=4,
            )

    def mdtraj(self, frames: slice | Indices | None = None) -> mdtraj.Trajectory:
        """An ``mdtraj.Trajectory`` with times in ps (in double precision), bonds and the periodic box.

        Parameters
        ----------
        frames : slice or list of int, optional
            All if not given.
        """
        chosen = self._chosen(frames)
        topology = read_topology(self._files.topology, self._description.particles)
        xyz = np.array([self.positions(frame) for frame in chosen], dtype=np.float32)
        trajectory = mdtraj.Trajectory(xyz, topology, time=self.times[chosen])
        if self.box is not None:
            trajectory.unitcell_vectors = np.repeat(self.box[None], len(chosen), axis=0)
        return trajectory

    def _chosen(self, frames):
        if frames is None:
            return np.arange(len(self))
        if isinstance(frames, slice):
            chosen = np.arange(len(self))[frames]
        else:
            chosen = np.array([self._frame(frame) for frame in numbers_of(frames, -len(self), "frames")], dtype=int)
        if not len(chosen):
            raise InputError("frames selects no frame.")
        return chosen

    def mdanalysis(self) -> Any:
        """An ``MDAnalysis.Universe`` with times in ps, bonds, radii, masses, the box, and positions in angstrom.

        Each filament is a segment (``segid``) with a residue for each node. All frames are held in memory.

        Raises
        ------
        InputError
            If MDAnalysis is not installed.
        """
        try:
            import MDAnalysis
            from MDAnalysis.coordinates.memory import MemoryReader
            from MDAnalysis.topology.PSFParser import PSFParser
        except ImportError:
            raise InputError("A Universe needs MDAnalysis: install it by pip install MDAnalysis.") from None
        topology = read_topology(self._files.topology, self._description.particles)
        atoms, residues = list(topology.atoms), list(topology.residues)
        universe = MDAnalysis.Universe.empty(
            len(atoms),
            n_residues=len(residues),
            n_segments=topology.n_chains,
            atom_resindex=[atom.residue.index for atom in atoms],
            residue_segindex=[residue.chain.index for residue in residues],
        )
        radii = np.zeros(len(atoms))
        for own in self.filaments:
            radii[own.nodes] = radii[own.control_points] = 5.0 * own.diameter
        for group in self.particles:
            radii[group.indices] = 5.0 * group.diameter
        names = [atom.name for atom in atoms]
        universe.add_TopologyAttr("names", names)
        universe.add_TopologyAttr("types", [self._type_names.get(i, name) for i, name in enumerate(names)])
        universe.add_TopologyAttr("radii", radii)
        universe.add_TopologyAttr("masses", PSFParser(str(self._files.topology_psf)).parse().masses.values)
        universe.add_TopologyAttr("resnames", [residue.name for residue in residues])
        universe.add_TopologyAttr("resids", [residue.resSeq for residue in residues])
        universe.add_TopologyAttr("segids", [f"F{number}" for number in range(topology.n_chains)])
        universe.add_TopologyAttr("bonds", [(one.index, other.index) for one, other in topology.bonds])
        xyz = np.array([10.0 * self.positions(frame) for frame in range(len(self))], dtype=np.float32)
        dimensions = None
        if self.box is not None:
            dimensions = np.array([*(10.0 * np.diag(self.box)), 90.0, 90.0, 90.0], dtype=np.float32)
        spacing = self._description.steps_per_frame * self.time_step
        universe.load_new(xyz, format=MemoryReader, order="fac", dt=spacing, dimensions=dimensions)
        return universe

    @property
    def _type_names(self):
        return {int(node): own.type.name for own in self.filaments for node in own.nodes}

    @property
    def stages(self) -> tuple[RunStage, ...]:
        """The stages of the run, in their order: none of one that has no ``[[stage]]`` tables."""
        found: list[RunStage] = []
        first = 1
        for own in self._description.stages:
            frames = range(first, min(first + own.frames, len(self)))
            first += own.frames
            if own.is_piece:
                found[-1] = RunStage(found[-1].name, found[-1].begin, range(found[-1].frames.start, frames.stop))
            else:
                found.append(RunStage(own.name, own.begin, frames))
        return tuple(own for own in found if len(own.frames))

    def nodes(self, frame: int) -> list[FloatArray]:
        """Positions (nodes, 3) in nm of the nodes that each filament has in a frame: none where it is not there."""
        positions = self.positions(frame)
        return [positions[nodes] for nodes in self._nodes_in(frame)]

    @cached_property
    def passing(self) -> frozenset[int]:
        """The numbers of filaments that are not there in some frame: that begin or vanish, are parts of others, or are
        not in all stages."""
        counts = self.growth.get("nodes", np.ones((0, 0)))
        gone = np.flatnonzero((counts == 0).any(axis=0))
        grown = {int(number) for number in self.growth["filament"][0][gone]} if len(gone) else set()
        return frozenset(grown.union(*self._absent_in_stages))

    @cached_property
    def _absent_in_stages(self):
        # Of filaments that do not grow, the numbers of those that a stage does not have: all particles in one place.
        fixed = [(number, own.nodes) for number, own in enumerate(self.filaments) if not own.monomer_length]
        frames = map(self.positions, np.minimum(self._last_frames, len(self) - 1).tolist())
        return [frozenset(i for i, nodes in fixed if np.all(frame[nodes] == frame[nodes[0]])) for frame in frames]

    @cached_property
    def _last_frames(self):
        return np.cumsum([own.frames for own in self._description.stages], dtype=int)

    def _absent(self, frame):
        stages = self._description.stages
        return self._absent_in_stages[np.searchsorted(self._last_frames, self._frame(frame))] if stages else frozenset()

    def monomers(self, frame: int) -> dict[int, IntArray]:
        """The number of the first monomer of filaments that grow, and that behind the last one, in a frame.

        By the numbers of filaments. They are counted from where the minus end was at the start.
        """
        if not self.growth:
            return {}
        ends = [self.growth[f"{end} end (monomers)"][self._frame(frame)] for end in ("minus", "plus")]
        numbers = self.growth["filament"][self._frame(frame)]
        return {int(number): np.array(own, dtype=int) for number, *own in zip(numbers, *ends)}

    def _nodes_in(self, frame):
        # Particles of the nodes that filaments have in a frame.
        nodes = [own.nodes for own in self.filaments]
        if self.growth:
            frame = self._frame(frame)
            for number, count in zip(self.growth["filament"][frame], self.growth["nodes"][frame]):
                nodes[int(number)] = nodes[int(number)][: int(count)]
        for number in self._absent(frame):
            nodes[number] = nodes[number][:0]
        return nodes

    def grown(self, frame: int) -> dict[int, GrownChain]:
        """What segments filaments that grow have in a frame, by the numbers of filaments."""
        monomers = self.monomers(frame)
        positions = self.positions(frame) if monomers else np.zeros((0, 3))
        chains = ((number, self.filaments[number], ends) for number, ends in monomers.items())
        return {
            number: GrownChain(own.type, own.monomer_length, ends, positions[own.nodes]) for number, own, ends in chains
        }

    def curves(self, frame: int, per_element: int = PIECES_OF_ELEMENT) -> list[FloatArray]:
        """Points (points, 3) in nm along each filament in a frame.

        Its nodes where segments are straight; of beam elements, ``per_element`` points of the curve of each, and the
        last node. Those of a ring end before its first point, to which the last one is joined.
        """
        positions, per_element = self.positions(frame), whole_number(per_element, 1, "per_element", 10**6)
        return [
            own.type.segment_kind.curve(positions[nodes], positions[own.control_points], per_element, own.ring)
            if len(nodes)
            else np.zeros((0, 3))
            for own, nodes in zip(self.filaments, self._nodes_in(frame))
        ]

    def bends(self, frame: int) -> list[FloatArray]:
        """Angles in radians by which each segment of each filament bends: (segments,) arrays.

        Of a beam element, between the tangents at its ends; of a straight segment, the mean of those at its joints.
        """
        positions = self.positions(frame)
        return [
            own.type.segment_kind.angles(positions[nodes], positions[own.control_points], own.ring)
            if len(nodes)
            else np.zeros(0)
            for own, nodes in zip(self.filaments, self._nodes_in(frame))
        ]

    def segment_tensions(self, frame: int, average: int = 1) -> list[FloatArray]:
        """Tensions dV_el/dl of the segments of each filament in kJ/(mol nm), averaged over frames about one.

        Of a beam element, EA times the mean strain along its arc.

        They hold the thermal fluctuation ``(k k_BT)^(1/2)`` of a stiff spring, which an average over n independent
        frames brings down by n^(1/2).

        Parameters
        ----------
        frame : int
        average : int
            Over how many frames, fewer at the ends of the run.

        Returns
        -------
        list of (segments,) arrays

        Raises
        ------
        InputError
            For an average over frames in which filaments that grow have other segments, or others come or go.
        """
        frame, average = self._frame(frame), whole_number(average, 1, "average")
        first = max(0, frame - (average - 1) // 2)
        frames = range(first, min(len(self), first + average))
        self.warn_of_rounding()
        if len(frames) > 1 and self.growth:
            raise InputError("Segments of filaments that grow come and go: take tensions of single frames, average=1.")
        absent = self._absent(frame)
        if any(self._absent(each) != absent for each in frames):
            raise InputError("Filaments come or go in these frames: take tensions of fewer, average=1.")
        totals = [np.zeros(0 if number in absent else own.segments) for number, own in enumerate(self.filaments)]
        for each in frames:
            positions, grown = self.positions(each), self.grown(each)
            for number, own in enumerate(self.filaments):
                if number in absent:
                    continue
                parts = positions[own.nodes], positions[own.control_points]
                if number in grown:
                    totals[number] = grown[number].tensions
                else:
                    totals[number] += own.type.segment_kind.tensions(chain_of(own, self.temperature), *parts)
        return [total / len(frames) for total in totals]


def require_run(run: Run) -> None:
    """Raise InputError for what has no filaments in frames."""
    if not (hasattr(run, "filaments") and hasattr(run, "box")):
        raise InputError(f"run must be a Run, as analysis.load returns it, but is {shown(run)}.")


def volume_of(run: Run, volume: Scalar | None) -> float:
    """A volume in nm^3; that of the periodic box of a run if None, InputError if it has none."""
    require_run(run)
    if volume is not None:
        return positive(volume, VOLUME, "volume")
    if run.box is None:
        raise InputError("There is no periodic box: give the volume that is meant.")
    return float(np.linalg.det(run.box))
