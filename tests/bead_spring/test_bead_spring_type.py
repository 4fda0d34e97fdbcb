"""BeadSpringType: its parameters, the forms of its energy, the preset and coarse graining."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import DSDNA_BASE_PAIRS, BeadSpringType, InputError
from openmm_cylchain.filaments.chain_type import ChainType
from openmm_cylchain.units.quantities import thermal_energy
from support.chain_energies import chain_energies

OPTIONS = dict(name="BSP", diameter=2.0, bead_spacing=0.5, bead_friction=1000.0, stretching_modulus=600.0)
KIND = BeadSpringType(**OPTIONS, bending_rigidity=120.0)


def energy_of_the_paper(kind, nodes):
    bonds = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(bonds, axis=1)
    stretching = 0.5 * kind.stiffness * np.sum((lengths - kind.natural_length) ** 2)
    return stretching - kind.bending_stiffness * np.sum(bonds[1:] * bonds[:-1])


def test_parameters():
    assert isinstance(KIND, ChainType)
    assert KIND.bending_stiffness == pytest.approx(120.0 / 0.5**3)
    assert KIND.segment_stiffness == pytest.approx(600.0 / 0.5)
    assert KIND.stiffness == pytest.approx(1200.0 + 2.0 * 960.0)
    # (13) and (3).
    assert KIND.stiffness * KIND.natural_length == pytest.approx(600.0)
    assert KIND.natural_length == pytest.approx(0.5 * (1.0 - 2.0 * KIND.nu))
    assert KIND.time_unit == pytest.approx(1000.0 / KIND.stiffness)
    spacing, b = KIND.bead_spacing, 1.0 / (1.0 - 2.0 * KIND.nu)
    expected = spacing * b**2 * KIND.nu / KIND.reduced_temperature(300.0)
    assert KIND.persistence_length_at(300.0) == pytest.approx(expected)
    assert (KIND.bending_model, KIND.stretching_model, KIND.maximum_extension) == ("bond-difference", "harmonic", None)


def test_units_and_persistence_length():
    rigidity = 30.0 * thermal_energy(310.0)
    given = BeadSpringType(
        name="BSP",
        diameter=2 * unit.nanometer,
        bead_spacing=5 * unit.angstrom,
        bead_friction=1000.0 * unit.kilojoule_per_mole * unit.picosecond / unit.nanometer**2,
        stretching_modulus=600.0 * unit.kilojoule_per_mole / unit.nanometer,
        persistence_length=30 * unit.nanometer,
        temperature=310 * unit.kelvin,
    )
    assert given == BeadSpringType(**OPTIONS, bending_rigidity=rigidity)
    assert given.persistence_length_at(310.0) == pytest.approx(30.0)
    assert hash(given) == hash(replace(given))
    with pytest.raises(FrozenInstanceError):
        given.bead_spacing = 1.0


def test_reduced_parameters_and_back():
    kind = BeadSpringType.from_reduced(
        name="BSP",
        diameter=2.0,
        nu=0.2,
        reduced_temperature=0.05,
        bead_spacing=0.7,
        temperature=280.0,
        bead_friction=3.0,
    )
    assert kind.nu == pytest.approx(0.2)
    assert kind.reduced_temperature(280.0) == pytest.approx(0.05)
    assert (kind.bead_spacing, kind.bead_friction) == (0.7, 3.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "TOOLONG"}, "1 to 5 letters"),
        ({"bead_spacing": 0.0}, "bead_spacing of filament type 'BSP' must be positive"),
        ({"bead_friction": -1.0}, "bead_friction of filament type 'BSP' must be positive"),
        ({"stretching_modulus": np.nan}, "finite"),
        ({"bending_rigidity": 0.0}, "bending_rigidity of filament type 'BSP' must be positive"),
        ({"bending_rigidity": None}, "either bending_rigidity or persistence_length"),
        ({"persistence_length": 30.0, "temperature": 300.0}, "either bending_rigidity or persistence_length"),
        ({"temperature": 300.0}, "go together"),
        ({"bending_rigidity": None, "persistence_length": 30.0}, "go together"),
        ({"diameter": 1.0 * unit.kelvin}, "diameter"),
    ],
)
def test_what_makes_no_sense_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        BeadSpringType(**{**OPTIONS, "bending_rigidity": 120.0, **changes})


@pytest.mark.parametrize(("nu", "temperature"), [(0.0, 0.1), (0.5, 0.1), (0.3, 0.0)])
def test_reduced_parameters_out_of_range(nu, temperature):
    with pytest.raises(InputError):
        BeadSpringType.from_reduced(
            name="BSP",
            diameter=2.0,
            nu=nu,
            reduced_temperature=temperature,
            bead_spacing=0.7,
            temperature=280.0,
            bead_friction=3.0,
        )


@pytest.mark.parametrize("nodes", [2, 3, 4, 9])
def test_the_energy_is_that_of_the_paper_up_to_a_constant(nodes):
    generator = np.random.default_rng(nodes)
    chains = generator.normal(size=(5, nodes, 3))
    difference = [sum(chain_energies(KIND, one)) - energy_of_the_paper(KIND, one) for one in chains]
    assert difference == pytest.approx(np.full(5, difference[0]))


@pytest.mark.parametrize("closed", [False, True])
def test_forces_are_gradients(closed):
    generator = np.random.default_rng(1)
    nodes = generator.normal(size=(6, 3))
    segments = 6 if closed else 5
    vectors = np.diff(nodes, axis=0, append=nodes[:1])[:segments]
    stiffnesses = np.linspace(0.5, 2.0, segments if closed else segments - 1) * KIND.bending_stiffness
    plus = KIND.bending_end_forces(vectors, stiffnesses, closed)
    forces = np.zeros((6, 3))
    for segment, force in enumerate(plus):
        forces[segment] -= force
        forces[(segment + 1) % 6] += force
    moved = 1e-6 * generator.normal(size=nodes.shape)
    energies = [chain_energies(KIND, nodes + sign * moved, stiffnesses, closed)[1] for sign in (1.0, -1.0)]
    assert energies[1] - energies[0] == pytest.approx(2.0 * np.sum(forces * moved), rel=1e-6)


def test_rings_have_no_ends():
    assert np.all(KIND.segment_lengths(5, closed=True) == KIND.bead_spacing)
    assert np.all(KIND.segment_stiffnesses(5, closed=True) == KIND.segment_stiffness)
    nodes = np.random.default_rng(3).normal(size=(5, 3))
    energies = chain_energies(KIND, nodes, closed=True)
    assert energies == pytest.approx(chain_energies(KIND, np.roll(nodes, 2, axis=0), closed=True))


def test_energies_of_several_chains_at_once():
    nodes = np.random.default_rng(3).normal(size=(2, 4, 6, 3))
    vectors = np.diff(nodes, axis=2)
    stretching = KIND.stretching_energies(np.linalg.norm(vectors, axis=3)).sum(axis=2)
    bending = KIND.bending_energies(vectors).sum(axis=2)
    expected = [[chain_energies(KIND, one) for one in row] for row in nodes]
    assert np.stack([stretching, bending], axis=2) == pytest.approx(np.array(expected))


def test_equivalent_cylinders_resist_as_beads_do():
    """Half of xi at either end, and nothing between the ends."""
    friction = KIND.segment_friction(1.0, 300.0)
    turning = friction.rotational / KIND.bead_spacing**2
    assert 0.25 * friction.parallel + turning == pytest.approx(0.5 * KIND.bead_friction)
    assert 0.25 * friction.parallel - turning == pytest.approx(0.0)
    assert (friction.parallel, friction.rotational) == (friction.perpendicular, friction.extensional)


def test_coarse_graining():
    """(54) and (55), and the parameters r = 120, y = 12000 that Table III belongs to from k = 2 on."""
    kT, spacing = thermal_energy(296.15), 0.33
    kind = BeadSpringType(
        name="BSP",
        diameter=2.0,
        bead_spacing=spacing,
        bead_friction=1.0,
        bending_rigidity=120.0 * spacing * kT,
        stretching_modulus=12000.0 * kT / (120.0 * spacing),
    )
    table = [
        (2, 0.008, 0.1875),
        (5, 0.002192, 0.0437956),
        (10, 0.001024, 0.0117188),
        (12, 0.000847, 0.00819672),
        (15, 0.000673, 0.00527704),
        (20, 0.000503, 0.00298211),
    ]
    for beads, reduced_temperature, nu in table:
        coarse = kind.coarse_grained(beads)
        assert coarse.nu == pytest.approx(nu, rel=1e-5)
        assert coarse.reduced_temperature(296.15) == pytest.approx(reduced_temperature, abs=1e-6)
        assert (coarse.bead_spacing, coarse.bead_friction) == (beads * spacing, beads)
        assert coarse.bending_rigidity == kind.bending_rigidity
    with pytest.raises(InputError, match="beads"):
        kind.coarse_grained(0)


def test_dna():
    kind = DSDNA_BASE_PAIRS
    assert kind.nu == pytest.approx(0.35)
    assert kind.reduced_temperature(296.15) == pytest.approx(0.034)
    assert kind.natural_length == pytest.approx(0.099)
    assert kind.persistence_length_at(296.15) == pytest.approx(37.75, abs=0.01)
    piconewton, mole = 0.602214076, 6.02214076e23
    assert kind.stretching_modulus / piconewton == pytest.approx(1215.0, abs=0.5)
    # kJ ps/(mol nm^2) in kg/s, and the unit of time.
    assert kind.bead_friction * 1e3 / mole * 1e-12 / 1e-18 == pytest.approx(1.91e-12, rel=1e-3)
    assert kind.bead_spacing**2 * kind.bead_friction / thermal_energy(296.15) == pytest.approx(50.9, abs=0.05)
    assert kind.time_unit == pytest.approx(0.156, abs=5e-4)
