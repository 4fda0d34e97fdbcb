"""Chains of beads as filaments: what is built of them, what they do in a simulation, and what is refused."""

import numpy as np
import openmm
import pytest

from openmm_cylchain import (
    DSDNA_BASE_PAIRS,
    F_ACTIN,
    Filaments,
    Flow,
    InputError,
    check_time_step,
    recommended_time_step,
    stability_bounds,
    theory,
    time_step_bounds,
)
from openmm_cylchain.time_steps.bead_spring_step import bead_spring_stability_bound
from openmm_cylchain.time_steps.schemes import EXPLICIT_SCHEMES
from openmm_cylchain.units.quantities import thermal_energy
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.platforms import ENGINES

ROOM, VISCOSITY = 296.15, 602.0
KIND = DSDNA_BASE_PAIRS


def chains(engine="compiled"):
    return Filaments(VISCOSITY, ROOM, engine=engine)


def context_of(filaments, scheme, step, seed=3):
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, scheme=scheme, random_seed=seed)
    return new_context(system, positions, integrator), integrator


@pytest.mark.parametrize(("engine", "scheme"), [("compiled", "implicit"), ("portable", "midpoint")])
def test_straight_chains_are_without_forces(engine, scheme):
    filaments = chains(engine)
    for segments in (1, 2, 9):
        filaments.add_straight(KIND, segments, [0, 3 * segments, 0], [1, 1, 0])
    context, _ = context_of(filaments, scheme, 0.001)
    assert forces_of(context) == pytest.approx(0.0, abs=1e-9 * KIND.stiffness)
    masses = [context.getSystem().getParticleMass(index)._value for index in range(3)]
    assert masses == [KIND.bead_mass] * 3


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("closed", [False, True])
def test_energies_and_forces_are_those_of_the_engine(closed, engine):
    filaments, generator = chains(engine), np.random.default_rng(4)
    nodes = 0.4 * generator.normal(size=(7, 3))
    filaments.add_nodes(KIND, nodes, closed=closed)
    context, _ = context_of(filaments, "midpoint", 0.001)
    energy = sum(filaments[0].energies(nodes))
    assert energy_of(context) == pytest.approx(energy, rel=1e-9)
    moved = 1e-6 * generator.normal(size=nodes.shape)
    change = sum(filaments[0].energies(nodes + moved)) - sum(filaments[0].energies(nodes - moved))
    work = np.sum(forces_of(context) * 2.0 * moved)
    assert change == pytest.approx(-work, rel=1e-6)


def test_tensions_are_the_pulls_of_bonds():
    """Phi = (what the next bond pulls with + what this one does)/2, whatever the motion of the beads."""
    filaments = chains()
    filaments.add_equilibrium(KIND, 6, 5)
    # Cylinders beside them change nothing.
    filaments.add_straight(F_ACTIN, 3, [0, 900, 0], [1, 0, 0])
    context, _ = context_of(filaments, "implicit", 0.01)
    tensions = filaments.in_context(context).joint_tensions()[0]._value
    nodes = positions_of(context)[:7]
    vectors = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(vectors, axis=1)
    plus = -KIND.stretching_derivatives(lengths)[:, None] * vectors / lengths[:, None]
    plus += KIND.bending_end_forces(vectors, filaments[0].joint_stiffnesses)
    assert tensions == pytest.approx(-0.5 * (plus[1:] + plus[:-1]))


@pytest.mark.parametrize(
    ("engine", "scheme"),
    [("compiled", "implicit"), ("compiled", "euler"), pytest.param("portable", "euler", marks=pytest.mark.slow)],
)
def test_equilibrium_is_kept(engine, scheme):
    """At the recommended step, without a warning."""
    segments, count = 10, 100
    filaments = chains(engine)
    for number in range(count):
        filaments.add_equilibrium(KIND, segments, number + 1, [0, 20 * number, 0])
    context, integrator = context_of(filaments, scheme, filaments.recommended_time_step(scheme=scheme))
    sums = []
    for _ in range(30):
        integrator.step(10 if scheme == "implicit" else 100)
        nodes = positions_of(context).reshape(count, segments + 1, 3)
        vectors = np.diff(nodes, axis=1)
        ends = np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1)
        sums.append([ends, np.sum(vectors[:, 0] ** 2, axis=1), np.sum(vectors[:, 5] ** 2, axis=1)])
    averages = np.mean(sums, axis=0)
    error = averages.std(axis=1, ddof=1) / np.sqrt(count)
    squares = theory.bead_spring_mean_square_lengths(KIND, segments, ROOM)
    exact = np.array([theory.chain_mean_square_end_to_end(KIND, segments, ROOM), squares[0], squares[5]])
    assert np.all(error < 0.02 * exact)
    assert np.all(np.abs(averages.mean(axis=1) - exact) < 4.0 * error + 0.01 * exact)


def test_a_single_bond_divides_no_step():
    filaments = chains()
    for number in range(200):
        filaments.add_equilibrium(KIND, 1, number + 1)
    context, integrator = context_of(filaments, "implicit", filaments.recommended_time_step("implicit"))
    integrator.step(100)
    assert integrator.getNumDividedSteps() < 1e-3 * 100 * 200
    nodes = positions_of(context).reshape(200, 2, 3)
    squares = np.sum((nodes[:, 1] - nodes[:, 0]) ** 2, axis=1)
    exact, error = theory.chain_mean_square_end_to_end(KIND, 1, ROOM), squares.std(ddof=1) / np.sqrt(200)
    assert abs(squares.mean() - exact) < 4.0 * error < 0.15 * exact


def test_the_check_of_a_step_knows_exact_averages_of_beads():
    filaments = chains()
    for number in range(20):
        filaments.add_equilibrium(KIND, 8, number + 1)
    _, system, positions = filaments.build()
    step = filaments.recommended_time_step("implicit")
    platform = openmm.Platform.getPlatform("Reference")
    check = check_time_step(filaments, system, positions, step, frames=200, equilibrium=True, platform=platform)
    exact = {one.name: one.exact for one in check.observables if one.exact is not None}
    kT, free = thermal_energy(ROOM), (KIND, 8, ROOM)
    assert exact == pytest.approx(
        {
            "DBP stretching energy": theory.bead_spring_stretching_energies(*free).mean() / kT,
            "DBP bending energy": theory.bead_spring_bending_energies(*free).mean() / kT,
            "DBP end to end, mean square": theory.bead_spring_mean_square_end_to_end(*free),
        }
    )
    for one in check.observables:
        assert one.exact is None or abs(one.deviation) < 4.0 * one.deviation_standard_error + 0.02


def test_a_chain_diffuses_as_its_beads_together():
    """D = k_B T/((N+1) xi), in one step."""
    filaments, count = chains(), 400
    for number in range(count):
        filaments.add_equilibrium(KIND, 4, number + 1, [0, 20 * number, 0])
    context, integrator = context_of(filaments, "implicit", 1.0)
    before = positions_of(context).reshape(count, 5, 3).mean(axis=1)
    integrator.step(10)
    moved = positions_of(context).reshape(count, 5, 3).mean(axis=1) - before
    kT = KIND.reduced_temperature(ROOM) * KIND.stiffness * KIND.natural_length**2
    expected = 6.0 * kT / (5.0 * KIND.bead_friction) * 10.0
    squares = np.sum(moved**2, axis=1)
    assert abs(squares.mean() - expected) < 4.0 * squares.std() / np.sqrt(count)
    assert squares.std() / np.sqrt(count) < 0.05 * expected


def test_places_on_a_chain_know_its_short_end_bonds():
    filaments = chains()
    filaments.add_straight(KIND, 8, [0, 0, 0], [1, 0, 0])
    filaments.add_attachment(0, arc_length=0.5 * KIND.straight_lengths(8)[0])
    filaments.add_attachment(0, arc_length=KIND.straight_lengths(8).sum())
    first, last = filaments.attachments
    assert (first.segment, first.fraction) == (0, pytest.approx(0.5))
    assert (last.segment, last.fraction) == (7, pytest.approx(1.0))
    with pytest.raises(InputError, match="arc_length"):
        filaments.add_attachment(0, arc_length=8 * KIND.bead_spacing)


def test_recommended_steps():
    unit = KIND.time_unit
    assert bead_spring_stability_bound(KIND) == pytest.approx(0.294 * unit, rel=1e-3)
    assert stability_bounds(KIND, VISCOSITY, ROOM) == {"springs": bead_spring_stability_bound(KIND)}

    def steps(scheme, kind=KIND):
        recommended = [
            recommended_time_step(kind, VISCOSITY, ROOM, scheme, bonds).step for bonds in (63, 127, 255, 511)
        ]
        return np.array(recommended) / kind.time_unit

    for scheme in EXPLICIT_SCHEMES:
        assert steps(scheme) == pytest.approx([bead_spring_stability_bound(KIND) / unit / 20] * 4)
    # No longer than in Table II.
    assert steps("modes") == pytest.approx([10.0, 40.0, 100.0, 100.0])
    assert steps("implicit") == pytest.approx([1e4] * 4)
    assert steps("implicit-second-order") == pytest.approx([1e3] * 4)
    assert recommended_time_step(KIND, VISCOSITY, ROOM, "implicit", 1).step == pytest.approx(0.3 * unit)
    assert np.all(steps("implicit", KIND.coarse_grained(5)) < steps("implicit"))
    rings = [recommended_time_step(KIND, VISCOSITY, ROOM, "implicit", 100, closed).step for closed in (False, True)]
    assert rings[1] < rings[0]
    flow = Flow(gradient=[[0, 1e-4 / unit, 0], [0, 0, 0], [0, 0, 0]])
    sheared = recommended_time_step(KIND, VISCOSITY, ROOM, "implicit", 127, flow=flow)
    assert sheared.step / unit == pytest.approx(0.03 / 1e-4)
    assert "strain" in sheared.reason
    assert "modes of bending that relax in" in sheared.describe_dynamics()


def test_what_is_for_cylinders_is_refused():
    with pytest.raises(InputError, match="stability_bounds"):
        time_step_bounds(KIND, VISCOSITY, ROOM)
    for function in (
        lambda: theory.mean_joint_cosine(KIND, ROOM),
        lambda: theory.chain_tangent_correlation(KIND, 2, ROOM),
        lambda: theory.chain_bending_mode_variance(KIND, 5, 1, ROOM),
        lambda: theory.chain_planar_bending_mode_variance(KIND, 5, 1, ROOM),
        lambda: theory.bending_energy_mean(KIND, ROOM),
        lambda: theory.bending_energy_variance(KIND, ROOM),
        lambda: theory.stretching_energy_mean(KIND, ROOM),
        lambda: theory.stretching_energy_variance(KIND, ROOM),
        lambda: theory.chain_extension(KIND, 5, 1.0, ROOM),
    ):
        with pytest.raises(InputError, match="has no straight segments of cylinders"):
            function()


@pytest.mark.parametrize("scheme", ["modes", "implicit", "implicit-second-order"])
def test_the_portable_engine_has_explicit_schemes_alone(scheme):
    filaments = chains("portable")
    filaments.add_straight(KIND, 3, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match=f"The portable engine does not have scheme '{scheme}': use the compiled"):
        filaments.create_integrator(system, 0.001, scheme=scheme)


def test_the_scheme_of_modes_is_for_free_open_chains_of_beads():
    nodes = 0.3 * np.random.default_rng(1).normal(size=(6, 3))
    for kind, options, message in (
        (F_ACTIN, {}, "but no cylinders"),
        (KIND, {"closed": True}, "is a ring"),
        (KIND, {"clamped": [0]}, "is clamped"),
    ):
        filaments = chains()
        scale = 1000.0 if kind is F_ACTIN else 1.0
        filaments.add_nodes(kind, scale * nodes, **options)
        _, system, _ = filaments.build()
        with pytest.raises(InputError, match=message):
            filaments.create_integrator(system, 0.01, scheme="modes")
    with pytest.raises(InputError, match="no cylinders"):
        recommended_time_step(F_ACTIN, VISCOSITY, ROOM, "modes")


def test_a_filament_needs_a_type():
    with pytest.raises(InputError, match="FilamentType, such as F_ACTIN, or a BeadSpringType"):
        chains().add_straight("DNA", 3, [0, 0, 0], [1, 0, 0])
