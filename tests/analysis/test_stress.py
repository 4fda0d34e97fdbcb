"""The stress of filaments under tension, and of any chains and linkers by straining them."""

import dataclasses

import numpy as np
import pytest

from openmm_cylchain import DSDNA_BASE_PAIRS, F_ACTIN, MICROTUBULE, InputError, analysis
from openmm_cylchain.analysis import CrosslinkFrame
from openmm_cylchain.analysis.run_filaments import RunFilament
from openmm_cylchain.beams.curve import BeamElement, beam_virial
from openmm_cylchain.beams.equilibrium import draw_beam
from openmm_cylchain.couplings.contact_frames import joined_contacts
from openmm_cylchain.filaments.placement import joint_stiffnesses
from openmm_cylchain.output.linker_records import LINKER_RECORD
from openmm_cylchain.units.quantities import thermal_energy
from support.chain_energies import chain_energies

TEMPERATURE, STIFFNESS, REST_LENGTH = 310.0, 0.3, 12.0


class PlacedRun:
    """What the stress needs of a run: (type, nodes, ring, clamped) and springs between places."""

    temperature = TEMPERATURE

    def __init__(self, chains, springs=(), box=None, crosslinks=((), (), ())):
        self.box = None if box is None else np.diag(np.array(box, dtype=float))
        self._nodes = [np.array(nodes, dtype=float) for _, nodes, *_ in chains]
        firsts = np.cumsum([0, *(len(own) for own in self._nodes)])
        self.filaments = [
            RunFilament(kind, first + np.arange(len(nodes)), kind.diameter, ring, clamped, planar=bool(planar))
            for first, (kind, nodes, ring, clamped, *planar) in zip(firsts, chains)
        ]
        records = np.zeros(len(springs), LINKER_RECORD)
        if len(springs):
            records["places"] = springs
            lengths = np.linalg.norm(np.diff(records["places"], axis=1)[:, 0], axis=1)
            records["tension"] = STIFFNESS * (lengths - REST_LENGTH)
        self.linkers = [records]
        self._springs, self._on, self._at_points = crosslinks

    def positions(self, frame):
        return np.concatenate(self._nodes)

    def nodes(self, frame):
        return self._nodes

    def crosslinks(self, frame):
        places = np.reshape(np.array(self._springs, dtype=float), (-1, 2, 3))
        tensions = STIFFNESS * np.linalg.norm(places[:, 1] - places[:, 0], axis=1)
        on, fixed = np.array(self._on, dtype=bool), np.array(self._at_points, dtype=bool)
        return CrosslinkFrame(np.arange(len(places)), places, np.where(on, tensions, 0.0), on, fixed)

    def contacts(self, frame):
        return joined_contacts([])

    def warn_of_rounding(self):
        pass


def test_a_filament_under_tension_between_two_planes():
    """Straight, stretched by 1 %: the force per area of the planes, and no stress across."""
    lengths = np.arange(6) * 1.01 * 360.0
    nodes = np.outer(lengths, [1.0, 0.0, 0.0])
    area = 500.0 * 400.0
    found = analysis.stress(PlacedRun([(F_ACTIN, nodes, False, (0, 5))]), 0, lengths[-1] * area)
    force = F_ACTIN.segment_stiffness * 3.6
    np.testing.assert_allclose(found.chains, np.diag([force / area, 0.0, 0.0]), atol=1e-12 * force)
    # Four nodes are free.
    pressure = 4 * thermal_energy(TEMPERATURE) / (lengths[-1] * area)
    np.testing.assert_allclose(found.ideal, -pressure * np.eye(3))
    np.testing.assert_allclose(found.total, found.chains + found.linkers + found.ideal)


def test_a_network_of_springs_in_a_box():
    """Springs that cross a periodic box along its axes: the force of each over its area."""
    springs = [[[0, 10 * n, 20], [100, 10 * n, 20]] for n in range(7)] + [[[5, 0, 3], [5, 200, 3]]]
    straight = (F_ACTIN, np.outer([0.0, 360.0], [0, 0, 1.0]), False, ())
    found = analysis.stress(PlacedRun([straight], springs, [100, 200, 400]), 0)
    forces = STIFFNESS * np.array([7 * (100 - REST_LENGTH), 200 - REST_LENGTH, 0.0])
    np.testing.assert_allclose(found.linkers, np.diag(forces / [200 * 400, 100 * 400, 1]), atol=1e-15)
    np.testing.assert_allclose(found.chains, 0.0, atol=1e-15)


def test_crosslinks_that_join_filaments_count():
    """Of rest length zero; one that is off and one at a fixed point do not."""
    springs = [[[0, 0, 0], [10, 0, 0]], [[0, 0, 0], [0, 20, 0]], [[0, 0, 0], [0, 0, 30]]]
    straight = (F_ACTIN, np.outer([0.0, 360.0], [0, 0, 1.0]), False, ())
    links = (springs, [True, False, True], [False, False, True])
    found = analysis.stress(PlacedRun([straight], crosslinks=links), 0, 50.0)
    np.testing.assert_allclose(found.crosslinks, np.diag([STIFFNESS * 100.0 / 50.0, 0.0, 0.0]))


@pytest.mark.parametrize("ring", [False, True])
@pytest.mark.parametrize(
    "kind",
    [
        F_ACTIN,
        MICROTUBULE,
        DSDNA_BASE_PAIRS,
        dataclasses.replace(F_ACTIN, bending_model="kratky-porod"),
        dataclasses.replace(F_ACTIN, stretching_model="fene", maximum_extension=180.0),
    ],
    ids=["actin", "microtubule", "beads", "kratky-porod", "fene"],
)
def test_stress_is_the_change_of_energy_by_strain(kind, ring):
    generator = np.random.default_rng(8)
    length = kind.segment_length
    if ring:
        angles = 2.0 * np.pi * np.arange(8) / 8
        nodes = length / (2.0 * np.sin(np.pi / 8)) * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    else:
        nodes = np.outer(np.arange(8), [length, 0.0, 0.0])
    nodes += 0.05 * length * generator.normal(size=nodes.shape)
    clamped = () if ring else (0,)
    stiffnesses = joint_stiffnesses(kind, 8, clamped, ring)

    def energy(strain):
        return sum(chain_energies(kind, nodes @ (np.eye(3) + strain).T, stiffnesses, ring))

    expected = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            strain = np.zeros((3, 3))
            strain[i, j] = 1e-6
            expected[j, i] = (energy(strain) - energy(-strain)) / 2e-6
    found = analysis.stress(PlacedRun([(kind, nodes, ring, clamped)]), 0, 7.0).chains
    scale = np.abs(expected).max()
    np.testing.assert_allclose(7.0 * found, expected, atol=1e-6 * scale)
    # No torque: the tensor is symmetric.
    np.testing.assert_allclose(found, found.T, atol=1e-9 * np.abs(found).max())


@pytest.mark.slow
def test_free_beams_in_equilibrium_press_as_ideal_gas():
    """Elements drawn from equilibrium: their virial takes up the ideal part of their four particles but one."""
    kT, generator = thermal_energy(TEMPERATURE), np.random.default_rng(5)
    element = BeamElement(length=100.0, rigidity=5000.0 * kT, modulus=kT)
    drawn = [draw_beam(element, 1, kT, generator, np.zeros(3), None, planar=False) for _ in range(3000)]
    virials = [np.trace(beam_virial(*own, element)) / (3.0 * kT) for own in drawn]
    error = np.std(virials) / np.sqrt(len(virials))
    assert error < 0.075
    assert np.mean(virials) == pytest.approx(4 - 1, abs=4 * error)


def test_without_a_volume():
    with pytest.raises(InputError, match="give the volume"):
        analysis.stress(PlacedRun([(F_ACTIN, np.outer([0.0, 360.0], [0, 0, 1.0]), False, ())]), 0)
