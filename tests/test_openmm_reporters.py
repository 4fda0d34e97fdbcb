"""Reporters of OpenMM and mdtraj: what they write of filaments beside other particles in a periodic box, read back."""

import csv

import mdtraj
import mdtraj.reporters
import numpy as np
import openmm
import pytest
from openmm import app, unit
from test_periodic import CUBIC, TRICLINIC, crossing, particles_of

STEPS = 4
STEP_SIZE = 5e3  # ps


def simulation_of(engine, vectors=CUBIC, seed=4):
    filaments, topology, system, positions = crossing(engine, vectors)
    integrator = filaments.create_integrator(
        system, STEP_SIZE, scheme="midpoint", particle_friction=5e5, random_seed=seed
    )
    simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("Reference"))
    # Several boxes away from the origin, and more than a micrometre.
    simulation.context.setPositions(positions + 4000 * unit.nanometer)
    return filaments, simulation


def frame(simulation, wrapped):
    state = simulation.context.getState(positions=True, enforcePeriodicBox=wrapped)
    return state.getPositions(asNumpy=True).value_in_unit(unit.nanometer)


def close(simulation):
    """Remove the reporters so that their files are complete on disk."""
    while simulation.reporters:
        getattr(simulation.reporters.pop(), "close", lambda: None)()


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
    filaments, simulation = simulation_of(engine, vectors)
    with open(tmp_path / "topology.cif", "w") as file:
        app.PDBxFile.writeFile(simulation.topology, frame(simulation, False) * unit.nanometer, file, keepIds=True)
    names = [name for name in TRAJECTORIES if wrapped or name not in ALWAYS_WRAPPED]
    for name in names:
        options = {} if name in ALWAYS_WRAPPED else {"enforcePeriodicBox": wrapped}
        simulation.reporters.append(TRAJECTORIES[name][0](str(tmp_path / name), 1, **options))
    expected = []
    for _ in range(STEPS):
        simulation.step(1)
        expected.append(frame(simulation, wrapped))
    close(simulation)
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
    _, simulation = simulation_of(engine)
    names = ["openmm.dcd", "mdtraj.dcd"]
    for name in names:
        simulation.reporters.append(TRAJECTORIES[name][0](str(tmp_path / name), 1))
    simulation.step(1)
    close(simulation)
    for name in names:
        read = mdtraj.load(str(tmp_path / name), top=mdtraj.Topology.from_openmm(simulation.topology))
        assert np.abs(read.xyz[0] - frame(simulation, True)).max() < SINGLE_PRECISION


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

    _, unbroken = simulation_of(engine)
    add_reporters(unbroken, "unbroken")
    unbroken.step(8)
    close(unbroken)
    _, first = simulation_of(engine)
    add_reporters(first, "parts")
    # Step 5 is lost: the last checkpoint is that of step 3, and the last frame that of step 2.
    first.step(3)
    close(first)
    first.step(2)
    _, second = simulation_of(engine)
    getattr(second, "loadState" if checkpoint == "state" else "loadCheckpoint")(str(tmp_path / "parts.chk"))
    assert second.currentStep == 3
    add_reporters(second, "parts", append=True)
    second.step(5)
    close(second)

    topology = mdtraj.Topology.from_openmm(unbroken.topology)
    for suffix in ("dcd", "xtc"):
        whole, parts = (mdtraj.load(str(tmp_path / f"{stem}.{suffix}"), top=topology) for stem in ("unbroken", "parts"))
        assert len(whole) == 4
        assert np.array_equal(parts.xyz, whole.xyz), suffix
    assert (tmp_path / "parts.csv").read_text() == (tmp_path / "unbroken.csv").read_text()
    assert np.array_equal(frame(second, False), frame(unbroken, False))


def test_state_data(engine, tmp_path):
    filaments, simulation = simulation_of(engine)
    names = ["step", "time", "potentialEnergy", "kineticEnergy", "totalEnergy", "temperature", "volume", "density"]
    path = tmp_path / "data.csv"
    simulation.reporters.append(app.StateDataReporter(str(path), 2, **dict.fromkeys(names, True)))
    simulation.step(2)
    (row,) = csv.reader(path.read_text().splitlines()[1:])
    values = dict(zip(names, map(float, row)))
    energy = simulation.context.getState(energy=True).getPotentialEnergy()._value
    assert values["step"] == 2 and values["time"] == 2 * STEP_SIZE
    assert values["potentialEnergy"] == values["totalEnergy"] == pytest.approx(energy)
    assert values["kineticEnergy"] == 0
    assert values["temperature"] == pytest.approx(310)
    assert values["volume"] == pytest.approx(1500.0**3)
    mass = sum(simulation.system.getParticleMass(i)._value for i in range(simulation.system.getNumParticles()))
    assert values["density"] == pytest.approx(mass * 1.66053907e-24 / (1500e-7) ** 3, rel=1e-6)


def test_pdb_files_lose_digits_beyond_a_micrometre_and_fail_beyond_ten_millimetres(tmp_path):
    """README says so: coordinates have eight characters, in angstrom, and OpenMM cuts off what is longer."""
    _, simulation = simulation_of("portable")
    for shift, error in ((0.0, 1e-3), (2e4, 1e-2), (1e6, 0.1)):
        path = tmp_path / f"{shift:.0f}.pdb"
        positions = frame(simulation, False) + shift
        with open(path, "w") as file:
            app.PDBFile.writeFile(simulation.topology, positions * unit.nanometer, file)
        read = app.PDBFile(str(path)).getPositions(asNumpy=True)._value
        assert 0.5 * error < np.abs(read - positions).max() <= 1.001 * error
    with open(tmp_path / "too_far.pdb", "w") as file, pytest.raises(ValueError, match="could not be represented"):
        app.PDBFile.writeFile(simulation.topology, (positions + 1e7) * unit.nanometer, file)
