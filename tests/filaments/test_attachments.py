"""Attachment points: where they are, how they follow, and what a force on them does."""

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError, analysis
from support.contexts import new_context, new_simulation, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

MICROSECOND = 1e6


def _context(filaments, system, positions, step, **options):
    integrator = filaments.create_integrator(system, step, **options)
    return new_context(system, positions, integrator)


def _filaments(engine):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_equilibrium(F_ACTIN, 5, seed=1)
    filaments.add_equilibrium(DSDNA, 3, seed=2, start=[0, 500, 0])
    filaments.add_attachment(1, segment=-1)
    filaments.add_attachment(0, arc_length=0.9 * unit.micrometer)
    filaments.add_attachment(0, arc_length=5 * 360)
    filaments.add_attachment(0, segment=0, fraction=0)
    return filaments


def test_places():
    filaments = _filaments(None)
    places = [(one.filament, one.segment, one.fraction) for one in filaments.attachments]
    assert places == [(1, 2, 0.5), (0, 2, 0.5), (0, 4, 1.0), (0, 0, 0.0)]


def test_particles_come_behind_the_nodes_of_their_filament():
    filaments = _filaments(None)
    topology, system, positions = filaments.build()
    assert filaments.attachment_indices.tolist() == [13, 6, 7, 8]
    assert [nodes.tolist() for nodes in filaments.node_indices] == [list(range(6)), list(range(9, 13))]
    assert [atom.name for atom in topology.atoms()] == ["NOD"] * 6 + ["ATT"] * 3 + ["NOD"] * 4 + ["ATT"]
    assert topology.getNumBonds() == 5 + 3 and topology.getNumChains() == 2
    nodes = positions._value
    assert nodes[7] == pytest.approx(nodes[5]) and nodes[8] == pytest.approx(nodes[0])
    assert nodes[13] == pytest.approx(0.5 * (nodes[11] + nodes[12]))
    assert all(system.isVirtualSite(int(index)) for index in filaments.attachment_indices)


@pytest.mark.parametrize("engine", ["portable", "compiled"])
def test_points_follow_in_the_same_step(engine):
    filaments = _filaments(engine)
    _, system, positions = filaments.build()
    context = _context(filaments, system, positions, 1.0, scheme="midpoint", random_seed=1)
    for _ in range(3):
        context.getIntegrator().step(1)
        now = positions_of(context)
        assert now[6] == pytest.approx(0.5 * (now[2] + now[3]), abs=1e-9)
        assert now[13] == pytest.approx(0.5 * (now[11] + now[12]), abs=1e-9)
    assert np.abs(now - positions._value).max() > 1e-3


@pytest.mark.parametrize("engine", ["portable", "compiled"])
@pytest.mark.parametrize("fraction", [0.0, 0.2, 0.5, 1.0])
def test_force_at_a_place_moves_and_turns_a_cylinder(engine, fraction):
    """F across at the place s moves the middle with F/gamma_perp and turns the cylinder with (s-1/2) l F/gamma_rot."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    filaments.add_attachment(0, segment=0, fraction=fraction)
    _, system, positions = filaments.build()
    force = openmm.CustomExternalForce("-0.1*y")
    force.addParticle(int(filaments.attachment_indices[0]), [])
    system.addForce(force)
    step = 10.0
    context = _context(filaments, system, positions, step, scheme="midpoint", temperature=0)
    context.getIntegrator().step(1)
    velocity = (positions_of(context) - positions._value)[:, 1] / step
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    middle, turning = 0.1 / friction.perpendicular, 0.1 * (fraction - 0.5) * 360 / friction.rotational
    assert velocity[:2] == pytest.approx([middle - 180 * turning, middle + 180 * turning], rel=1e-5, abs=1e-15)


def test_points_in_the_trajectory_may_be_hidden(tmp_path):
    filaments = _filaments(None)
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1.0, random_seed=1)
    simulation = new_simulation(topology, system, positions, integrator)
    hidden = [int(index) for index in np.setdiff1d(range(system.getNumParticles()), filaments.attachment_indices)]
    simulation.reporters.append(app.DCDReporter(str(tmp_path / "all.dcd"), 1))
    simulation.reporters.append(app.DCDReporter(str(tmp_path / "nodes.dcd"), 1, atomSubset=hidden))
    simulation.step(3)
    with open(tmp_path / "topology.cif", "w") as file:
        app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
    simulation.reporters.clear()
    trajectory = mdtraj.load(str(tmp_path / "all.dcd"), top=str(tmp_path / "topology.cif"))
    assert trajectory.n_atoms == 14
    lengths = analysis.segment_lengths(trajectory)
    assert [one.shape for one in lengths] == [(3, 5), (3, 3)]
    nodes = trajectory.atom_slice(hidden)
    alone = mdtraj.load(str(tmp_path / "nodes.dcd"), top=nodes.topology)
    assert np.array_equal(alone.xyz, nodes.xyz)


def test_filaments_with_points_join_a_system_that_has_other_particles():
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    nonbonded = openmm.NonbondedForce()
    for _ in range(2):
        topology.addAtom("P", None, topology.addResidue("PRT", chain))
        system.addParticle(1.0)
        nonbonded.addParticle(0.1, 1.0, 0.5)
    system.addForce(nonbonded)
    filaments = _filaments(None)
    positions = filaments.add_to(topology, system, [[0, 0, 300], [0, 5, 300]])
    assert filaments.attachment_indices.tolist() == [15, 8, 9, 10]
    assert len(positions) == system.getNumParticles() == nonbonded.getNumParticles() == 16
    integrator = filaments.create_integrator(system, 1.0, particle_friction=1e4, random_seed=1)
    context = new_context(system, positions, integrator)
    integrator.step(2)
    assert np.isfinite(positions_of(context)).all()


def test_bad_places_are_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    for arguments, message in (
        ({"filament": 1, "segment": 0}, "Attachment point 0: filament 1 does not exist; there are 1"),
        ({"filament": 0}, "Attachment point 0: give either arc_length or segment"),
        ({"filament": 0, "segment": 0, "arc_length": 1}, "give either arc_length or segment"),
        ({"filament": 0, "segment": 2}, "segment 2 does not exist; there are 2"),
        ({"filament": 0, "segment": -3}, "segment must be at least -2"),
        ({"filament": 0, "segment": 0.5}, "segment must be a whole number"),
        ({"filament": 0, "segment": 0, "fraction": 1.01}, "fraction must be a number between 0 and 1"),
        ({"filament": 0, "segment": 0, "fraction": np.nan}, "fraction must be finite"),
        ({"filament": 0, "arc_length": 721}, "arc_length is 721 nm, but the filament is 720 nm long"),
        ({"filament": 0, "arc_length": -1}, "arc_length cannot be negative"),
        ({"filament": 0, "arc_length": 1, "fraction": 0.5}, "a fraction goes with a segment"),
        ({"filament": 0, "arc_length": 1 * unit.kelvin}, "arc_length has the unit"),
    ):
        with pytest.raises(InputError, match=message):
            filaments.add_attachment(**arguments)
    with pytest.raises(InputError, match="not in a System yet"):
        _ = filaments.attachment_indices
    filaments.build()
    with pytest.raises(InputError, match="Attachment point 0 comes too late"):
        filaments.add_attachment(0, segment=0)
