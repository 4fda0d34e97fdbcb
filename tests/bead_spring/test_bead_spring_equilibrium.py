"""The exact equilibrium of bead-spring chains against printed and measured values, quadrature, identities and draws."""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import DSDNA_BASE_PAIRS, F_ACTIN, BeadSpringType, InputError, theory
from openmm_cylchain.units.quantities import thermal_energy
from support.chain_energies import chain_energies

ROOM = 296.15


def chain_of(nu, reduced_temperature):
    """A type with d = 1 nm and lambda d^2 = k_B T/T* at 300 K."""
    return BeadSpringType.from_reduced(
        name="BSP",
        diameter=1.0,
        nu=nu,
        reduced_temperature=reduced_temperature,
        bead_spacing=1.0 / (1.0 - 2.0 * nu),
        temperature=300.0,
        bead_friction=1.0,
    )


RANGE = [(1e-5, 1e-6), (1e-5, 1.0), (0.01, 5e-4), (0.2, 100.0), (0.35, 0.034), (0.35, 3.0), (0.49, 1e-4), (0.49, 0.05)]


@pytest.mark.parametrize(
    ("bonds", "end_to_end", "middle"),
    [(63, 35444, 140.60), (127, 124960, 957.88), (255, 382740, 5805.1), (511, 997360, 28582)],
)
def test_dna_of_the_papers_lengths(bonds, end_to_end, middle):
    """<L^2>, <u^2> and <(r - R)^2> in the middle, in units of d, found by another transfer operator before."""
    unit_area = DSDNA_BASE_PAIRS.natural_length**2
    chain = DSDNA_BASE_PAIRS, bonds, ROOM
    assert theory.bead_spring_mean_square_end_to_end(*chain) / unit_area == pytest.approx(end_to_end, rel=2e-5)
    squares = theory.bead_spring_mean_square_lengths(*chain) / unit_area
    assert squares[bonds // 2] == pytest.approx(11.1587, rel=1e-5)
    found = theory.bead_spring_mean_square_distances_from_center(*chain, beads=[(bonds + 1) // 2])
    assert found / unit_area == pytest.approx([middle], rel=2e-5)
    lengths = theory.bead_spring_mean_lengths(*chain) / DSDNA_BASE_PAIRS.natural_length
    assert lengths[:4] == pytest.approx([1.992, 2.786, 3.110, 3.242], abs=0.001)
    assert lengths[::-1] == pytest.approx(lengths)


def test_dna_persistence_length():
    length = theory.bead_spring_persistence_length(DSDNA_BASE_PAIRS, ROOM)
    assert length / DSDNA_BASE_PAIRS.bead_spacing == pytest.approx(112.70, abs=0.005)
    # In a plane, they decorrelate over twice as much.
    planar = theory.bead_spring_persistence_length(DSDNA_BASE_PAIRS, ROOM, planar=True)
    assert planar / length == pytest.approx(1.0, rel=0.02)
    # It is what bonds in the middle of a long chain decorrelate over.
    correlations = theory.bead_spring_bond_correlations(DSDNA_BASE_PAIRS, 80, ROOM)[30, 42:60]
    assert -1.0 / np.diff(np.log(correlations)) == pytest.approx(112.70, abs=0.01)


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("bonds", [1, 2, 3, 20])
@pytest.mark.parametrize(("nu", "reduced_temperature"), RANGE)
def test_virial(nu, reduced_temperature, bonds, planar):
    """``<sum_n u_n.dH/du_n> = D N k_B T``, exact for any energy, here with that of eq. (1)."""
    chain = chain_of(nu, reduced_temperature), bonds, 300.0, planar
    squares, lengths = theory.bead_spring_mean_square_lengths(*chain), theory.bead_spring_mean_lengths(*chain)
    neighbours = np.diag(theory.bead_spring_bond_correlations(*chain), 1)
    virial = squares.sum() - lengths.sum() - 2.0 * nu * neighbours.sum()
    dimensions = 2 if planar else 3
    assert virial / reduced_temperature == pytest.approx(dimensions * bonds, rel=1e-5)


def by_quadrature(nu, reduced_temperature, planar):
    """<u_1^2>, <u_1.u_2> of two bonds, by sums over lengths and the angle between them with the energy of eq. (1)."""
    reach = 9.0 * np.sqrt(reduced_temperature / (1.0 - 2.0 * nu))
    node, weight = np.polynomial.legendre.leggauss(96)
    low, high = max(0.0, 1.0 / (1.0 - nu) - reach), 1.0 / (1.0 - nu) + reach
    length = 0.5 * (high + low + (high - low) * node)
    angle = 0.5 * np.pi * (node + 1.0)
    u, v, theta = np.meshgrid(length, length, angle, indexing="ij")
    energy = 0.5 * ((u - 1.0) ** 2 + (v - 1.0) ** 2) - nu * u * v * np.cos(theta)
    measure = u * v if planar else u**2 * v**2 * np.sin(theta)
    density = np.einsum("i,j,k->ijk", weight, weight, weight) * measure
    density *= np.exp(-(energy - energy.min()) / reduced_temperature)
    density /= density.sum()
    return np.sum(density * u**2), np.sum(density * u * v * np.cos(theta))


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize(("nu", "reduced_temperature"), [(0.35, 0.034), (0.35, 0.5), (0.1, 0.02), (0.45, 5.0)])
def test_two_bonds_by_quadrature(nu, reduced_temperature, planar):
    square, product = by_quadrature(nu, reduced_temperature, planar)
    found = theory.bead_spring_bond_correlations(chain_of(nu, reduced_temperature), 2, 300.0, planar)
    assert found == pytest.approx(np.array([[square, product], [product, square]]), rel=1e-7)


def test_three_bonds_by_monte_carlo():
    """Metropolis moves of beads with the energy of eq. (1), which knows of no transfer operator."""
    nu, reduced_temperature, chains = 0.3, 0.2, 4000
    generator = np.random.default_rng(5)
    bonds = np.tile([[2.0, 0.0, 0.0]], (chains, 3, 1))

    def energy(bonds):
        length = np.linalg.norm(bonds, axis=2)
        products = np.einsum("cbk,cbk->cb", bonds[:, 1:], bonds[:, :-1])
        return (0.5 * np.sum((length - 1.0) ** 2, axis=1) - nu * products.sum(axis=1)) / reduced_temperature

    samples, current = [], energy(bonds)
    for sweep in range(1500):
        trial = bonds.copy()
        trial[:, sweep % 3] += generator.normal(scale=0.5, size=(chains, 3))
        proposed = energy(trial)
        accepted = generator.random(chains) < np.exp(np.minimum(current - proposed, 0.0))
        bonds, current = np.where(accepted[:, None, None], trial, bonds), np.where(accepted, proposed, current)
        if sweep >= 300 and sweep % 30 == 0:
            samples.append(np.einsum("cik,cjk->cij", bonds, bonds))
    averages = np.mean(samples, axis=0)
    error = averages.std(axis=0) / np.sqrt(chains)
    exact = theory.bead_spring_bond_correlations(chain_of(nu, reduced_temperature), 3, 300.0)
    assert np.all(error < 0.01 * np.diag(exact).max())
    assert np.all(np.abs(averages.mean(axis=0) - exact) < 4.0 * error)


def test_a_cold_chain_is_straight():
    kind = chain_of(0.4, 1e-8)
    straight = kind.straight_lengths(12)
    assert theory.bead_spring_mean_lengths(kind, 12, 300.0) == pytest.approx(straight, rel=1e-6)
    end_to_end = theory.bead_spring_mean_square_end_to_end(kind, 12, 300.0)
    assert end_to_end == pytest.approx(straight.sum() ** 2, rel=1e-5)
    # Without forces.
    nodes = np.outer(np.concatenate([[0.0], np.cumsum(straight)]), [1.0, 0.0, 0.0])
    shorter, longer = (sum(chain_energies(kind, scale * nodes)) for scale in (1.0 - 1e-4, 1.0 + 1e-4))
    assert shorter == pytest.approx(longer, rel=1e-6)
    assert min(shorter, longer) > sum(chain_energies(kind, nodes))


@pytest.mark.parametrize("planar", [False, True])
def test_sums_over_bonds_agree(planar):
    chain = chain_of(0.3, 0.1), 9, 300.0
    correlations = theory.bead_spring_bond_correlations(*chain, planar)
    assert theory.bead_spring_mean_square_end_to_end(*chain, planar) == pytest.approx(correlations.sum())
    weights = np.tril(np.ones((10, 9)), -1)
    beads = weights @ correlations @ weights.T
    centred = beads - beads.mean(axis=0) - beads.mean(axis=1)[:, None] + beads.mean()
    squares = theory.bead_spring_mean_square_distances_from_center(*chain, planar)
    assert squares == pytest.approx(np.diag(centred))
    gyration = theory.bead_spring_mean_square_radius_of_gyration(*chain, planar)
    assert gyration == pytest.approx(squares.mean())
    # Modes are an orthonormal basis of the distances from the centre.
    modes = theory.bead_spring_mode_variances(chain[0], 9, np.arange(1, 10), 300.0, planar)
    assert modes.sum() == pytest.approx(10.0 * gyration)


def test_energies_add_up():
    """The mean of eq. (1) from moments of bonds, and from the mean energies of bonds and joints."""
    nu, reduced_temperature = 0.35, 0.05
    kind = chain_of(nu, reduced_temperature)
    chain = kind, 7, 300.0
    squares, lengths = theory.bead_spring_mean_square_lengths(*chain), theory.bead_spring_mean_lengths(*chain)
    neighbours = np.diag(theory.bead_spring_bond_correlations(*chain), 1)
    mean = 0.5 * np.sum(squares - 2.0 * lengths + 1.0) - nu * neighbours.sum()
    straight = np.outer(np.concatenate([[0.0], np.cumsum(kind.straight_lengths(7))]), [0.0, 1.0, 0.0])
    bonds = kind.straight_lengths(7)
    lowest = 0.5 * np.sum((bonds - 1.0) ** 2) - nu * np.sum(bonds[1:] * bonds[:-1])
    excess = theory.bead_spring_stretching_energies(*chain).sum() + theory.bead_spring_bending_energies(*chain).sum()
    excess -= sum(chain_energies(kind, straight))
    assert excess / kind.stiffness == pytest.approx(mean - lowest, rel=1e-9)


DRAWN = [
    (0.35, 0.034, 1),
    (0.35, 0.034, 2),
    (0.35, 0.034, 3),
    pytest.param(0.35, 0.034, 12, marks=pytest.mark.slow),
    (0.1, 1.0, 6),
    (1e-4, 0.01, 5),
]


@pytest.mark.sample(r"^(?!0\.1-1\.0-6-True|0\.35-0\.034-12-True)")
@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize(
    ("nu", "reduced_temperature", "bonds"), [*DRAWN, pytest.param(0.49, 0.02, 6, marks=pytest.mark.slow)]
)
def test_draws_have_the_exact_moments(nu, reduced_temperature, bonds, planar):
    from openmm_cylchain.bead_spring.draws import draw_bonds

    count = 5000
    drawn = draw_bonds(nu, reduced_temperature, bonds, np.random.default_rng(11), count, planar)
    assert drawn.shape == (count, bonds, 3)
    lengths = np.linalg.norm(drawn, axis=2)
    chain = chain_of(nu, reduced_temperature), bonds, 300.0, planar
    products = np.einsum("cik,cjk->cij", drawn, drawn)
    pairs = [
        (lengths, theory.bead_spring_mean_lengths(*chain)),
        ((lengths - lengths.mean(axis=0)) ** 2, np.diag(products.mean(axis=0)) - lengths.mean(axis=0) ** 2),
        (products.reshape(count, -1), theory.bead_spring_bond_correlations(*chain).ravel()),
        (np.sum(drawn.sum(axis=1) ** 2, axis=1)[:, None], [theory.bead_spring_mean_square_end_to_end(*chain)]),
        (drawn.reshape(count, -1), np.zeros(3 * bonds)),
    ]
    for values, exact in pairs:
        error = values.std(axis=0) / np.sqrt(count)
        assert np.all(error <= 0.03 * np.sqrt(np.mean(values**2, axis=0)))
        assert np.all(np.abs(values.mean(axis=0) - exact) <= 4.5 * error + 1e-12)
    assert not planar or np.all(drawn[:, :, 2] == 0.0)


def test_lengths_are_drawn_from_their_distribution():
    """Of a single bond: u^2 exp(-(u - 1)^2/2T*), by the Kolmogorov-Smirnov statistic."""
    from openmm_cylchain.bead_spring.draws import draw_bonds

    reduced_temperature, count = 0.3, 40000
    drawn = np.linalg.norm(draw_bonds(0.2, reduced_temperature, 1, np.random.default_rng(2), count)[:, 0], axis=1)
    length = np.linspace(0.0, 8.0, 400001)
    cumulative = np.cumsum(length**2 * np.exp(-((length - 1.0) ** 2) / (2.0 * reduced_temperature)))
    probability = np.interp(np.sort(drawn), length, cumulative / cumulative[-1])
    statistic = np.max(np.abs(probability - (np.arange(count) + 0.5) / count)) * np.sqrt(count)
    # Exceeded by chance once in 10^4.
    assert statistic < 2.2


def test_a_chain_is_drawn_where_and_as_it_is_asked_for():
    kind, direction = DSDNA_BASE_PAIRS, np.array([0.6, 0.8, 0.0])
    for planar in (False, True):
        chains = [
            kind.draw_chain(5, ROOM, np.random.default_rng(seed), [1.0, 2.0, 3.0], direction, planar)
            for seed in (4, 4, 5)
        ]
        assert np.array_equal(chains[0], chains[1]) and not np.array_equal(chains[0], chains[2])
        assert chains[0].shape == (6, 3) and chains[0][0] == pytest.approx([1.0, 2.0, 3.0])
        first = chains[0][1] - chains[0][0]
        assert first / np.linalg.norm(first) == pytest.approx(direction)
        assert not planar or np.all(chains[0][:, 2] == 3.0)


@pytest.mark.slow
def test_a_long_chain():
    """10^4 bonds: what is added to <L^2> by a bond is the same for all of them once the chain is long."""
    bonds = 10_000
    nodes = DSDNA_BASE_PAIRS.draw_chain(bonds, ROOM, np.random.default_rng(1))
    lengths = np.linalg.norm(np.diff(nodes, axis=0), axis=1) / DSDNA_BASE_PAIRS.natural_length
    # Neighbours are anticorrelated or correlated over a few bonds at most: 4 standard errors of their mean.
    assert lengths.mean() == pytest.approx(3.3350, abs=4 * 0.222 * 2.5 / np.sqrt(bonds))
    assert lengths.std() == pytest.approx(0.2219, rel=0.06)
    squares = [theory.bead_spring_mean_square_end_to_end(DSDNA_BASE_PAIRS, n, ROOM) for n in (bonds - 2000, bonds)]
    persistence = theory.bead_spring_persistence_length(DSDNA_BASE_PAIRS, ROOM)
    spacing = DSDNA_BASE_PAIRS.bead_spacing
    assert (squares[1] - squares[0]) / 2000 == pytest.approx(2.0 * persistence * spacing, rel=2e-3)


def test_refusals():
    with pytest.raises(InputError, match="BeadSpringType"):
        theory.bead_spring_mean_lengths(F_ACTIN, 5, ROOM)
    with pytest.raises(InputError, match="bonds"):
        theory.bead_spring_mean_lengths(DSDNA_BASE_PAIRS, 0, ROOM)
    with pytest.raises(InputError, match="temperature"):
        theory.bead_spring_mean_lengths(DSDNA_BASE_PAIRS, 5, 0.0 * unit.kelvin)
    with pytest.raises(InputError, match="beads must be from 0 to 5"):
        theory.bead_spring_mean_square_distances_from_center(DSDNA_BASE_PAIRS, 5, ROOM, beads=[6])
    with pytest.raises(InputError, match="modes must be from 0 to"):
        theory.bead_spring_mode_variances(DSDNA_BASE_PAIRS, 5, [6], ROOM)


def test_reduced_units():
    kind = chain_of(0.3, 0.2)
    assert kind.natural_length == pytest.approx(1.0)
    assert kind.reduced_temperature(300.0) == pytest.approx(0.2)
    assert kind.stiffness == pytest.approx(thermal_energy(300.0) / 0.2)
