"""Files with bonds for VMD and OVITO: read back by mdtraj and OpenMM, and column by column."""

import io
import re

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError
from openmm_cylchain.output.structure_files import write_lammps_data, write_mmcif, write_psf
from support.solvent import TEMPERATURE, VISCOSITY

BOX = np.array([[1500.0, 0.0, 0.0], [400.0, 1400.0, 0.0], [-600.0, 500.0, 1600.0]])


def mixed_system():
    """Two molecules, one with names that are too long for the format, a clamped filament and one with an attachment."""
    topology, system = app.Topology(), openmm.System()
    water = topology.addChain("W")
    charges = openmm.NonbondedForce()
    residue = topology.addResidue("HOH", water, "17")
    oxygen = topology.addAtom("O", app.element.oxygen, residue)
    for name in ("H1", "H2"):
        topology.addBond(oxygen, topology.addAtom(name, app.element.hydrogen, residue))
    for mass, charge in ((15.99943, -0.834), (1.007947, 0.417), (1.007947, 0.417)):
        system.addParticle(mass)
        charges.addParticle(charge, 0.3, 0.0)
    system.addForce(charges)
    strange = topology.addChain("a chain with a long name")
    for name, number in (("9 long name", "12A"), ("", "x")):
        topology.addAtom(name, None, topology.addResidue("LONGRESIDUE", strange, number))
        system.addParticle(3.5e6)
        charges.addParticle(0.0, 1.0, 0.0)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_equilibrium(F_ACTIN, 3, seed=1, clamped=[0])
    filaments.add_equilibrium(DSDNA, 9, seed=2, start=[0, 500, 0])
    filaments.add_attachment(1, segment=2)
    positions = filaments.add_to(topology, system, 100 * np.arange(15).reshape(5, 3))
    return topology, system, positions


def read_psf_columns(path):
    """Atoms and bonds of an extended X-PLOR file, by the columns in which VMD and Fortran programs look for them.

    (I10,1X,A8,1X,A8,1X,A8,1X,A8,1X,A6,1X,2G14.6,I8) for atoms, of whose names VMD takes seven characters, and (8I10)
    for bonds.
    """
    lines = path.read_text().splitlines()
    assert lines[0].split() == ["PSF", "EXT", "XPLOR"]
    start = next(number for number, line in enumerate(lines) if "!NATOM" in line)
    atoms = []
    for line in lines[start + 1 : start + 1 + int(lines[start][:10])]:
        assert {line[column] for column in (10, 19, 28, 37, 46, 53)} == {" "}
        assert not line[47].isdigit()
        fields = [line[first : first + 7].strip() for first in (11, 29, 38)]
        atoms.append(
            (int(line[:10]), int(line[20:28]), *fields, line[47:53].strip(), *map(float, line[54:].split()[:2]))
        )
        assert float(line[54:68]) == atoms[-1][-2] and float(line[68:82]) == atoms[-1][-1]
        assert [line[first + 7] for first in (11, 29, 38)] == [" "] * 3
    start = next(number for number, line in enumerate(lines) if "!NBOND" in line)
    fields = []
    for line in lines[start + 1 :]:
        if not line.strip():
            break
        fields += [int(line[first : first + 10]) for first in range(0, len(line), 10)]
    bonds = list(zip(fields[::2], fields[1::2]))
    assert len(bonds) == int(lines[start][:10])
    return atoms, bonds


def test_psf_by_columns(tmp_path):
    topology, system, _ = mixed_system()
    write_psf(topology, tmp_path / "mixed.psf", system)
    atoms, bonds = read_psf_columns(tmp_path / "mixed.psf")
    assert bonds == [(first.index + 1, second.index + 1) for first, second in topology.bonds()]
    assert [atom[0] for atom in atoms] == list(range(1, 21))
    masses = [system.getParticleMass(particle)._value for particle in range(20)]
    assert [atom[7] for atom in atoms] == pytest.approx(masses, rel=1e-6)
    assert [atom[6] for atom in atoms] == pytest.approx([-0.834, 0.417, 0.417] + [0] * 17)
    assert atoms[0][1:6] == (17, "W", "HOH", "O", "O")
    assert [atom[1:6] for atom in atoms[3:5]] == [
        (1, "a_chain", "LONGRES", "9_long_", "X9_lon"),
        (2, "a_chain", "LONGRES", "X", "X"),
    ]
    assert [atom[1:6] for atom in atoms[5:9]] == [(number, "F0", "ACT", "NOD", "NOD") for number in range(1, 5)]
    assert atoms[-1][1:6] == (11, "F1", "DNA", "ATT", "ATT")
    assert atoms[5][7] == atoms[-1][7] == 0


def test_psf_by_other_readers(tmp_path):
    topology, system, _ = mixed_system()
    path = str(tmp_path / "mixed.psf")
    write_psf(topology, path, system)
    expected = [(first.index, second.index) for first, second in topology.bonds()]
    read = mdtraj.load_psf(path)
    assert [(first.index, second.index) for first, second in read.bonds] == expected
    assert [atom.name for atom in read.atoms][-11:] == ["NOD"] * 10 + ["ATT"]
    assert [chain.n_atoms for chain in read.chains] == [chain_length(chain) for chain in topology.chains()]
    assert read.n_residues == topology.getNumResidues()
    read = app.CharmmPsfFile(path)
    assert [(bond.atom1.idx, bond.atom2.idx) for bond in read.bond_list] == expected
    assert [atom.mass.value_in_unit(unit.dalton) for atom in read.atom_list] == pytest.approx(
        [system.getParticleMass(particle)._value for particle in range(20)], rel=1e-6
    )


def test_mmcif_has_ids_that_others_read(tmp_path):
    """A PDB file may leave ids of chains blank, or say one twice; ids of residues may be no numbers."""
    topology = app.Topology()
    for name, residues in ((" ", ["1", "2"]), ("A", ["7", "8"]), ("A", ["1", "x"]), ("", ["1"]), ("B c", ["-3"])):
        chain = topology.addChain(name)
        atoms = [topology.addAtom("CA", None, topology.addResidue("XYZ", chain, number)) for number in residues]
        for first, second in zip(atoms, atoms[1:]):
            topology.addBond(first, second)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    system = openmm.System()
    for _ in range(topology.getNumAtoms()):
        system.addParticle(1.0)
    positions = filaments.add_to(topology, system, np.arange(24.0).reshape(8, 3))
    ids = [(chain.id, [one.id for one in chain.residues()]) for chain in topology.chains()]
    write_mmcif(topology, positions, tmp_path / "all.cif")
    assert [(chain.id, [one.id for one in chain.residues()]) for chain in topology.chains()] == ids
    read = mdtraj.load(str(tmp_path / "all.cif"))
    assert [chain.n_residues for chain in read.topology.chains] == [2, 2, 2, 1, 1, 3]
    bonds = [(first.index, second.index) for first, second in topology.bonds()]
    assert [(first.index, second.index) for first, second in read.topology.bonds] == bonds
    np.testing.assert_allclose(read.xyz[0], positions._value, atol=1e-4)
    again = app.PDBxFile(str(tmp_path / "all.cif")).topology
    assert [chain.id for chain in again.chains()] == ["C1", "C2", "C3", "C4", "C5", "F0"]
    assert [[one.id for one in chain.residues()] for chain in again.chains()][1:3] == [["7", "8"], ["1", "2"]]
    with pytest.raises(InputError, match="positions must have the shape"):
        write_mmcif(topology, positions[:3], tmp_path / "all.cif")


def test_masses_of_a_psf_may_be_given(tmp_path):
    topology, system, _ = mixed_system()
    write_psf(topology, tmp_path / "mixed.psf", system, np.arange(20) * unit.dalton)
    atoms, _ = read_psf_columns(tmp_path / "mixed.psf")
    assert [atom[7] for atom in atoms] == list(range(20))
    with pytest.raises(InputError, match="masses must have the shape"):
        write_psf(topology, tmp_path / "mixed.psf", system, [1.0])


def chain_length(chain):
    return sum(1 for _ in chain.atoms())


def test_a_trajectory_is_read_with_a_psf(tmp_path):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(30):
        filaments.add_equilibrium(F_ACTIN, 4, seed=number)
    topology, system, positions = filaments.build()
    write_psf(topology, tmp_path / "filaments.psf", system)
    with open(tmp_path / "filaments.dcd", "wb") as file:
        app.DCDFile(file, topology, 1.0).writeModel(positions)
    trajectory = mdtraj.load(str(tmp_path / "filaments.dcd"), top=str(tmp_path / "filaments.psf"))
    assert trajectory.topology.n_chains == 30 and trajectory.topology.n_bonds == 120
    assert trajectory.xyz[0] == pytest.approx(positions._value, abs=1e-3)


def test_more_than_99999_atoms(tmp_path):
    topology = app.Topology()
    count = 100_020
    for _ in range(2):
        chain = topology.addChain("same")
        for node in range(count // 2):
            topology.addAtom("NOD", None, topology.addResidue("ACT", chain, str(node + 1)))
        nodes = list(chain.atoms())
        for first, second in zip(nodes, nodes[1:]):
            topology.addBond(first, second)
    write_psf(topology, tmp_path / "many.psf")
    atoms, bonds = read_psf_columns(tmp_path / "many.psf")
    assert len(atoms) == count and len(bonds) == count - 2
    assert bonds[-1] == (count - 1, count) and atoms[-1][:3] == (count, count // 2, "C2")


def sections(text):
    """Lines of a LAMMPS data file by the section they are in; those before the first belong to "header"."""
    found, current = {"header": []}, "header"
    for line in text.splitlines()[1:]:
        if re.match(r"[A-Z]", line):
            current = line
            found[current] = []
        elif line.strip():
            found[current].append(line.split())
    return found


@pytest.mark.parametrize("vectors", [None, np.diag([1500.0, 1600.0, 1700.0]), BOX], ids=["open", "cuboid", "triclinic"])
def test_lammps_data(vectors, tmp_path):
    topology, system, positions = mixed_system()
    if vectors is not None:
        topology.setPeriodicBoxVectors(vectors * unit.nanometer)
    write_lammps_data(topology, positions, tmp_path / "mixed.data", system)
    found = sections((tmp_path / "mixed.data").read_text())
    assert list(found) == ["header", "Masses", "Atoms # molecular", "Bonds"]
    counts = {" ".join(line[1:]): int(line[0]) for line in found["header"][:4]}
    assert counts == {"atoms": 20, "bonds": 14, "atom types": 7, "bond types": 3}
    masses = {line[3]: float(line[1]) for line in found["Masses"]}
    nodes = [system.getParticleMass(particle)._value for particle in range(5, 19)]
    assert masses["O"] == pytest.approx(15.99943) and masses["ATT"] == 1 and masses["NOD"] == pytest.approx(max(nodes))
    rows = np.array(found["Atoms # molecular"], dtype=float)
    assert rows[:, 0].tolist() == list(range(1, 21))
    assert rows[:, 1].tolist() == [1] * 3 + [2] * 2 + [3] * 4 + [4] * 11
    assert rows[:, 3:] == pytest.approx(10 * positions._value, rel=1e-9)
    types = {line[0]: line[3] for line in found["Masses"]}
    assert [types[line[2]] for line in found["Atoms # molecular"]][:5] == ["O", "H1", "H2", "9_long_name", "X"]
    bonds = [(int(line[2]) - 1, int(line[3]) - 1) for line in found["Bonds"]]
    assert bonds == [(first.index, second.index) for first, second in topology.bonds()]
    bounds = np.array([line[:2] for line in found["header"][4:7]], dtype=float)
    if vectors is None:
        extent = np.ptp(positions._value, axis=0).max()
        assert np.diff(bounds) == pytest.approx(10 * (3 * extent + 1))
        assert bounds.mean(axis=1) == pytest.approx(
            5 * (positions._value.min(axis=0) + positions._value.max(axis=0)), abs=1e-4
        )
    else:
        assert bounds == pytest.approx(np.stack([np.zeros(3), 10 * np.diag(vectors)], axis=1))
    tilted = vectors is BOX
    assert (found["header"][-1] == ["4000", "-6000", "5000", "xy", "xz", "yz"]) == tilted
    text = io.StringIO()
    write_lammps_data(topology, positions._value * 10 * unit.angstrom, text, system, vectors)
    assert text.getvalue() == (tmp_path / "mixed.data").read_text()


def test_masses_of_elements_where_there_is_no_system(tmp_path):
    topology, _, positions = mixed_system()
    write_psf(topology, tmp_path / "mixed.psf")
    atoms, _ = read_psf_columns(tmp_path / "mixed.psf")
    assert [atom[7] for atom in atoms] == pytest.approx([15.99943, 1.007947, 1.007947] + [0] * 17)
    assert [atom[6] for atom in atoms] == [0] * 20
    text = io.StringIO()
    write_lammps_data(topology, positions, text)
    assert {float(line[1]) for line in sections(text.getvalue())["Masses"]} == {15.99943, 1.007947, 1.0}


def test_no_bonds_and_no_atoms():
    topology = app.Topology()
    for _ in range(2):
        psf, data = io.StringIO(), io.StringIO()
        write_psf(topology, psf)
        write_lammps_data(topology, np.zeros((topology.getNumAtoms(), 3)), data)
        assert f"{topology.getNumAtoms():10d} !NATOM" in psf.getvalue() and "         0 !NBOND" in psf.getvalue()
        assert f"{topology.getNumAtoms()} atoms" in data.getvalue() and "Bonds" not in data.getvalue()
        topology.addAtom("A", None, topology.addResidue("R", topology.addChain()))


def test_bad_input_is_refused(tmp_path):
    topology, system, positions = mixed_system()
    path = tmp_path / "file"
    for arguments, message in (
        ((mdtraj.Topology(), path), "topology must be an openmm.app.Topology"),
        ((topology, path, openmm.System()), "The Topology has 20 atoms, but the System has 0 particles"),
    ):
        with pytest.raises(InputError, match=message):
            write_psf(*arguments)
    for arguments, message in (
        ((None, positions, path), "topology must be an openmm.app.Topology"),
        ((topology, positions, path, openmm.System()), "the System has 0 particles"),
        ((topology, positions[:-1], path), r"positions must have the shape \(20, 3\), but have \(19, 3\)"),
        ((topology, positions._value * np.nan, path), "positions must be finite"),
        ((topology, positions._value * unit.kelvin, path), "positions has the unit"),
        ((topology, positions, path, system, BOX.T), "box_vectors must be three vectors"),
        ((topology, positions, path, system, 0 * BOX), "box_vectors must be three vectors"),
        ((topology, positions, path, system, [1, 2, 3]), "box_vectors must be three vectors"),
    ):
        with pytest.raises(InputError, match=message):
            write_lammps_data(*arguments)
    assert not path.exists()
