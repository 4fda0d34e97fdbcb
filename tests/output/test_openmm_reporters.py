"""Reporters of OpenMM and mdtraj: what they write of filaments beside other particles in a periodic box, read back."""

import csv

import mdtraj
import mdtraj.reporters
import numpy as np
import pytest
from openmm import app, unit

from support.contexts import close_reporters, energy_of, positions_of
from support.periodic_systems import CUBIC, STEP_SIZE, TRICLINIC, crossing_simulation, particles_of

STEPS = 4


# What writes the file, and the largest error of a coordinate of up to 10000 nm: half the last digit that the format
# keeps, and the errors of single precision, in which XTC computes its whole numbers too.
SINGLE_PRECISION = 1e4 * 2.0**-24
XTC = 5e-4 + 3 * SINGLE_PRECISION
TRAJECTORIES = {
    "openmm.dcd": (app.DCDReporter, SINGLE_PRECISION),
    "openmm.xtc": (app.XTCReporter, XTC),
    "openmm.cif": (app.PDBxReporter, 5e-6 + SINGLE_PRECISION),
    "openmm.pdb": (app.PDBReporter, 0.01),
    "mdtraj.dcd": (mdtraj.reporters.DCDReporter, SINGLE_PRECISION),
    "mdtraj.xtc": (mdtraj.reporters.XTCReporter, XTC),
    "mdtraj.nc": (mdtraj.reporters.NetCDFReporter, SINGLE_PRECISION),
}
ALWAYS_WRAPPED = ("mdtraj.dcd", "mdtraj.xtc", "mdtraj.nc")  # where forces are periodic: they have no option for it


@pytest.mark.filterwarnings("ignore:.*netCDF4.*")
@pytest.mark.parametrize("vectors", [CUBIC, TRICLINIC], ids=["cubic", "triclinic"])
@pytest.mark.parametrize("wrapped", [False, True])
def test_trajectories_read_back(engine, wrapped, vectors, tmp_path):
    filaments, simulation = crossing_simulation(engine, vectors)
    with open(tmp_path / "topology.cif", "w") as file:
        app.PDBxFile.writeFile(
            simulation.topology, positions_of(simulation.context) * unit.nanometer, file, keepIds=True
        )
    names = [name for name in TRAJECTORIES if wrapped or name not in ALWAYS_WRAPPED]
    for name in names:
        options = {} if name in ALWAYS_WRAPPED else {"enforcePeriodicBox": wrapped}
        simulation.reporters.append(TRAJECTORIES[name][0](str(tmp_path / name), 1, **options))
    expected = []
    for _ in range(STEPS):
        simulation.step(1)
        expected.append(positions_of(simulation.context, wrapped))
    close_reporters(simulation)
    topology = mdtraj.load(str(tmp_path / "topology.cif")).topology
    for name in names:
        tolerance = TRAJECTORIES[name][1]
        read = mdtraj.load(str(tmp_path / name), **({} if name[-3:] in ("cif", "pdb") else {"top": topology}))
        assert read.xyz.shape == (STEPS, len(expected[0]), 3), name
        assert np.abs(read.xyz - expected).max() <= tolerance, name
        # Angles in PDB files have two decimals.
        digits = 0.2 if name == "openmm.pdb" else 2e-3
        assert np.abs(read.unitcell_vectors - vectors).max() < digits, name
        for nodes in filaments.node_indices:
            lengths = np.linalg.norm(np.diff(read.xyz[:, nodes], axis=1), axis=2)
            assert 300 < lengths.min() and lengths.max() < 420, name
    if wrapped:
        middles = [np.mean(expected[0][particles], axis=0) for particles in particles_of(filaments)]
        assert np.all(np.array(middles) @ np.linalg.inv(vectors) < 1)
    else:
        assert expected[0].max() > 3000


def test_wrapping_is_the_default_where_forces_are_periodic(engine, tmp_path):
    _, simulation = crossing_simulation(engine)
    names = ["openmm.dcd", "mdtraj.dcd"]
    for name in names:
        simulation.reporters.append(TRAJECTORIES[name][0](str(tmp_path / name), 1))
    simulation.step(1)
    close_reporters(simulation)
    for name in names:
        read = mdtraj.load(str(tmp_path / name), top=mdtraj.Topology.from_openmm(simulation.topology))
        assert np.abs(read.xyz[0] - positions_of(simulation.context, True)).max() < SINGLE_PRECISION


@pytest.mark.parametrize("checkpoint", ["binary", "state"])
def test_files_go_on_after_a_restart(engine, checkpoint, tmp_path):
    def add_reporters(simulation, stem, append=False):
        columns = dict(step=True, time=True, potentialEnergy=True, append=append)
        simulation.reporters += [
            app.DCDReporter(str(tmp_path / f"{stem}.dcd"), 2, append=append, enforcePeriodicBox=False),
            app.XTCReporter(str(tmp_path / f"{stem}.xtc"), 2, append=append, enforcePeriodicBox=False),
            app.StateDataReporter(str(tmp_path / f"{stem}.csv"), 2, **columns),
            app.CheckpointReporter(str(tmp_path / f"{stem}.chk"), 3, writeState=checkpoint == "state"),
        ]

    _, unbroken = crossing_simulation(engine)
    add_reporters(unbroken, "unbroken")
    unbroken.step(8)
    close_reporters(unbroken)
    _, first = crossing_simulation(engine)
    add_reporters(first, "parts")
    # Step 5 is lost: the last checkpoint is that of step 3, and the last frame that of step 2.
    first.step(3)
    close_reporters(first)
    first.step(2)
    _, second = crossing_simulation(engine)
    getattr(second, "loadState" if checkpoint == "state" else "loadCheckpoint")(str(tmp_path / "parts.chk"))
    assert second.currentStep == 3
    add_reporters(second, "parts", append=True)
    second.step(5)
    close_reporters(second)

    topology = mdtraj.Topology.from_openmm(unbroken.topology)
    for suffix in ("dcd", "xtc"):
        whole, parts = (mdtraj.load(str(tmp_path / f"{stem}.{suffix}"), top=topology) for stem in ("unbroken", "parts"))
        assert len(whole) == 4
        assert np.array_equal(parts.xyz, whole.xyz), suffix
    assert (tmp_path / "parts.csv").read_text() == (tmp_path / "unbroken.csv").read_text()
    assert np.array_equal(positions_of(second.context), positions_of(unbroken.context))


def test_state_data(engine, tmp_path):
    filaments, simulation = crossing_simulation(engine)
    names = ["step", "time", "potentialEnergy", "kineticEnergy", "totalEnergy", "temperature", "volume", "density"]
    path = tmp_path / "data.csv"
    simulation.reporters.append(app.StateDataReporter(str(path), 2, **dict.fromkeys(names, True)))
    simulation.step(2)
    (row,) = csv.reader(path.read_text().splitlines()[1:])
    values = dict(zip(names, map(float, row)))
    energy = energy_of(simulation.context)
    assert values["step"] == 2 and values["time"] == 2 * STEP_SIZE
    assert values["potentialEnergy"] == values["totalEnergy"] == pytest.approx(energy)
    assert values["kineticEnergy"] == 0
    assert values["temperature"] == pytest.approx(310)
    assert values["volume"] == pytest.approx(1500.0**3)
    mass = sum(simulation.system.getParticleMass(i)._value for i in range(simulation.system.getNumParticles()))
    assert values["density"] == pytest.approx(mass * 1.66053907e-24 / (1500e-7) ** 3, rel=1e-6)


def test_pdb_files_lose_digits_beyond_a_micrometre_and_fail_beyond_ten_millimetres(tmp_path):
    """README says so: coordinates have eight characters, in angstrom, and OpenMM cuts off what is longer."""
    _, simulation = crossing_simulation("portable")
    for shift, error in ((0.0, 1e-3), (2e4, 1e-2), (1e6, 0.1)):
        path = tmp_path / f"{shift:.0f}.pdb"
        positions = positions_of(simulation.context) + shift
        with open(path, "w") as file:
            app.PDBFile.writeFile(simulation.topology, positions * unit.nanometer, file)
        read = app.PDBFile(str(path)).getPositions(asNumpy=True)._value
        assert 0.5 * error < np.abs(read - positions).max() <= 1.001 * error
    with open(tmp_path / "too_far.pdb", "w") as file, pytest.raises(ValueError, match="could not be represented"):
        app.PDBFile.writeFile(simulation.topology, (positions + 1e7) * unit.nanometer, file)
