"""Files with the bonds of a Topology, for programs that show trajectories.

A PSF file is what VMD loads before a DCD or XTC trajectory, a LAMMPS data file what OVITO does, an mmCIF file what
mdtraj does. They hold everything that is in the Topology, filaments and other molecules alike.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
import openmm
from openmm import unit

from ..errors import InputError
from ..units.quantities import LENGTH, MASS, in_units_of, require_kind, shown
from ..units.types import BoxVectors, Numbers, Vectors
from ..version import __version__
from .files import TextFile, check_output_path

if TYPE_CHECKING:
    from openmm import app

_PSF_NAME_LENGTH = 7  # The fields have eight columns, of which VMD reads seven.
_PSF_TYPE_LENGTH = 6
_PSF_BONDS_PER_LINE = 4
_PSF_EMPTY_SECTIONS = (
    "NTHETA: angles",
    "NPHI: dihedrals",
    "NIMPHI: impropers",
    "NDON: donors",
    "NACC: acceptors",
    "NNB",
)
_ANGSTROM = 10.0  # in a nanometre


def write_mmcif(topology: app.Topology, positions: Vectors, file: TextFile) -> None:
    """Write an mmCIF file with the ids of chains and residues, which readers such as mdtraj find bonds by.

    It is that of ``openmm.app.PDBxFile`` with ``keepIds=True``, where ids can be read: chains whose id is blank, has
    blanks in it or is that of another one too, and residues of a chain in which an id is no number, are numbered.

    Parameters
    ----------
    topology : openmm.app.Topology
    positions : (particles, 3) length
    file : str, Path or file object

    Raises
    ------
    InputError
        If the topology is none, or the number of positions does not fit.

    Examples
    --------
    >>> write_mmcif(topology, positions, "topology.cif")  # doctest: +SKIP
    """
    from openmm import app

    positions, text = _positions_of(topology, positions), io.StringIO()
    with _readable_ids(topology):
        app.PDBxFile.writeFile(topology, positions * unit.nanometer, text, keepIds=True)
    _write(file, text.getvalue())


@contextmanager
def _readable_ids(topology):
    chains, residues = list(topology.chains()), list(topology.residues())
    there = [one.id for one in (*chains, *residues)]
    names = Counter(str(chain.id) for chain in chains)
    for number, chain in enumerate(chains, 1):
        if names[str(chain.id)] > 1 or not re.fullmatch(r"[\w+-]+", str(chain.id), re.ASCII):
            name = f"C{number:X}"
            chain.id = name if name not in names else f"{name}_{number:X}"
        for residue, own in zip(chain.residues(), _residue_numbers(chain)):
            residue.id = str(own)
    try:
        yield
    finally:
        for one, own in zip((*chains, *residues), there):
            one.id = own


def write_psf(
    topology: app.Topology,
    file: TextFile,
    system: openmm.System | None = None,
    masses: Numbers | None = None,
) -> None:
    """Write a PSF file: atoms, masses, charges and bonds, in CHARMM's extended X-PLOR format.

    Chains become segments of the file. Names are cut to the seven characters that VMD reads. Where ids of chains are
    not unique, or ids of a chain's residues are no numbers, they are numbered.

    Parameters
    ----------
    topology : openmm.app.Topology
    file : str, Path or file object
    system : openmm.System, optional
        Gives masses, and charges if it has a NonbondedForce. Without it, masses are those of the elements, zero for
        atoms of no element such as nodes, and charges are zero.
    masses : (particles,) masses, optional
        Instead of these: a System has none for particles that do not move.

    Raises
    ------
    InputError
        If the topology is none, or the System or the masses have another number of particles.

    Examples
    --------
    >>> write_psf(topology, "topology.psf", system)  # doctest: +SKIP
    """
    _check_topology(topology, system)
    masses = np.asarray(_masses(topology, system) if masses is None else in_units_of(masses, MASS, "masses"))
    if masses.shape != (topology.getNumAtoms(),):
        raise InputError(f"masses must have the shape ({topology.getNumAtoms()},), but have {masses.shape}.")
    numbers = _atom_numbers(topology)
    lines = ["PSF EXT XPLOR", "", f"{1:10d} !NTITLE", f" REMARKS openmm-cylchain {__version__}", ""]
    lines += [f"{len(numbers):10d} !NATOM", *_psf_atoms(topology, system, masses), ""]
    lines += [f"{topology.getNumBonds():10d} !NBOND: bonds"]
    bonds = [f"{numbers[first]:10d}{numbers[second]:10d}" for first, second in topology.bonds()]
    lines += ["".join(bonds[i : i + _PSF_BONDS_PER_LINE]) for i in range(0, len(bonds), _PSF_BONDS_PER_LINE)]
    for section in _PSF_EMPTY_SECTIONS:
        lines += ["", f"{0:10d} !{section}", ""]
    _write(file, "\n".join([*lines, ""]))


def _psf_atoms(topology, system, masses):
    properties = enumerate(zip(masses, _charges(topology, system)), 1)
    for chain, segment in zip(topology.chains(), _segment_names(topology)):
        for residue, residue_number in zip(chain.residues(), _residue_numbers(chain)):
            for atom in residue.atoms():
                number, (mass, charge) = next(properties)
                residue_name, name = (_word(one.name, _PSF_NAME_LENGTH) for one in (residue, atom))
                yield (
                    f"{number:10d} {segment:8s} {residue_number:<8d} {residue_name:8s} {name:8s} {_psf_type(atom):6s} "
                    f"{charge:14.6g}{mass:14.7g}{0:8d}"
                )


def write_lammps_data(
    topology: app.Topology,
    positions: Vectors,
    file: TextFile,
    system: openmm.System | None = None,
    box_vectors: BoxVectors | None = None,
) -> None:
    """Write a LAMMPS data file of style "molecular": particles, names, masses, positions, box and bonds, in angstrom.

    Atom types are the names of atoms, bond types the pairs of them, molecules the chains. Without a periodic box, the
    cell is three times as wide as what it holds: the format knows periodic cells alone, and no bond must look shorter
    across one.

    Parameters
    ----------
    topology : openmm.app.Topology
    positions : (particles, 3) length
    file : str, Path or file object
    system : openmm.System, optional
        Gives masses: a type has the largest of its atoms. Without it, masses are those of the elements. The format
        allows no mass of zero, so a type of massless atoms has 1 Da.
    box_vectors : three (3,) lengths, optional
        Those of the Topology if not given.

    Raises
    ------
    InputError
        If the topology is none, or the number of particles or the box vectors do not fit.

    Examples
    --------
    >>> write_lammps_data(topology, positions, "topology.data", system)  # doctest: +SKIP
    """
    positions = _positions_of(topology, positions, system)
    numbers, bonds = _atom_numbers(topology), list(topology.bonds())
    names = [_word(atom.name, None) for atom in numbers]
    pairs = ["-".join(sorted(_word(atom.name, None) for atom in bond)) for bond in bonds]
    atom_types = {name: number for number, name in enumerate(dict.fromkeys(names), 1)}
    bond_types = {pair: number for number, pair in enumerate(dict.fromkeys(pairs), 1)}
    mass_of = dict.fromkeys(names, 0.0)
    for name, mass in zip(names, _masses(topology, system)):
        mass_of[name] = max(mass_of[name], mass)

    lines = [f"LAMMPS data file, angstrom and dalton, openmm-cylchain {__version__}", ""]
    lines += [f"{len(numbers)} atoms", f"{len(bonds)} bonds", f"{len(atom_types)} atom types"]
    lines += [f"{len(bond_types)} bond types", "", *_lammps_cell(topology, positions, box_vectors), "", "Masses", ""]
    lines += [f"{number} {mass_of[name] or 1.0:.10g} # {name}" for name, number in atom_types.items()]
    lines += ["", "Atoms # molecular", ""]
    for (atom, number), name, place in zip(numbers.items(), names, _ANGSTROM * positions):
        x, y, z = place
        lines.append(f"{number} {atom.residue.chain.index + 1} {atom_types[name]} {x:.10g} {y:.10g} {z:.10g}")
    if bonds:
        lines += ["", "Bonds", ""]
    for number, (bond, pair) in enumerate(zip(bonds, pairs), 1):
        lines.append(f"{number} {bond_types[pair]} {numbers[bond[0]]} {numbers[bond[1]]}")
    _write(file, "\n".join([*lines, ""]))


def _positions_of(topology, positions, system=None):
    _check_topology(topology, system)
    positions = np.asarray(in_units_of(positions, LENGTH, "positions"))
    if positions.shape != (topology.getNumAtoms(), 3):
        raise InputError(f"positions must have the shape ({topology.getNumAtoms()}, 3), but have {positions.shape}.")
    return positions


def _check_topology(topology, system):
    from openmm import app

    if not isinstance(topology, app.Topology):
        raise InputError(f"topology must be an openmm.app.Topology, but is {shown(topology)}.")
    if system is not None:
        require_kind(system, openmm.System, "system")
    if system is not None and system.getNumParticles() != topology.getNumAtoms():
        raise InputError(
            f"The Topology has {topology.getNumAtoms()} atoms, but the System has {system.getNumParticles()} particles."
        )


def _atom_numbers(topology):
    # Numbers from 1 by atoms, in the order in which OpenMM makes particles of them.
    return {atom: number for number, atom in enumerate(topology.atoms(), 1)}


def _write(file, text):
    if hasattr(file, "write"):
        file.write(text)
    else:
        check_output_path(file)
        with open(file, "w", encoding="utf-8") as opened:
            opened.write(text)


def _masses(topology, system):
    if system is not None:
        return [system.getParticleMass(particle).value_in_unit(MASS) for particle in range(system.getNumParticles())]
    return [0.0 if atom.element is None else atom.element.mass.value_in_unit(MASS) for atom in topology.atoms()]


def _charges(topology, system):
    forces = [] if system is None else [one for one in system.getForces() if isinstance(one, openmm.NonbondedForce)]
    if not forces:
        return [0.0] * topology.getNumAtoms()
    parameters = (forces[0].getParticleParameters(particle) for particle in range(topology.getNumAtoms()))
    return [charge.value_in_unit(unit.elementary_charge) for charge, _, _ in parameters]


def _word(name, length):
    # Most readers split lines at blanks, so a name must have none, and must not be empty.
    return re.sub(r"[^!-~]+", "_", str(name or "") or "X")[:length]


def _psf_type(atom):
    # VMD takes a type that begins with a digit for a number in a narrower field.
    kind = _word(atom.name, _PSF_TYPE_LENGTH)
    return f"X{kind}"[:_PSF_TYPE_LENGTH] if kind[0].isdigit() else kind


def _segment_names(topology):
    names = [_word(chain.id, _PSF_NAME_LENGTH) for chain in topology.chains()]
    return names if len(set(names)) == len(names) else [f"C{number:X}" for number in range(1, len(names) + 1)]


def _residue_numbers(chain):
    residues = list(chain.residues())
    numbers = [int(one.id) for one in residues if re.fullmatch(r"-?\d{1,7}", str(one.id))]
    return numbers if len(set(numbers)) == len(residues) else range(1, len(residues) + 1)


def _lammps_cell(topology, positions, box_vectors):
    vectors = topology.getPeriodicBoxVectors() if box_vectors is None else box_vectors
    if vectors is None:
        extent = np.ptp(positions, axis=0).max(initial=0.0) if len(positions) else 0.0
        middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0)) if len(positions) else np.zeros(3)
        vectors = (3.0 * extent + 1.0) * np.eye(3)
        origin = middle - 0.5 * np.diag(vectors)
    else:
        vectors, origin = np.asarray(in_units_of(vectors, LENGTH, "box_vectors")), np.zeros(3)
    if vectors.shape != (3, 3) or np.any(np.triu(vectors, 1)) or np.any(np.diag(vectors) <= 0):
        raise InputError(
            "box_vectors must be three vectors, the first along x and the second in the plane of x and y, but are "
            f"{vectors.tolist()}."
        )
    vectors, origin = _ANGSTROM * vectors, _ANGSTROM * origin
    lines = [
        f"{start:.10g} {start + width:.10g} {axis}lo {axis}hi"
        for start, width, axis in zip(origin, np.diag(vectors), "xyz")
    ]
    if np.any(np.tril(vectors, -1)):
        lines.append(f"{vectors[1, 0]:.10g} {vectors[2, 0]:.10g} {vectors[2, 1]:.10g} xy xz yz")
    return lines
