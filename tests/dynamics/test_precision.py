"""Steps in mixed precision: right in the mean, the same path as in double precision, and never in silence."""

import copy
import dataclasses

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, Flow, InputError
from openmm_cylchain.engines.compiled import PRECISIONS, CylinderChainIntegrator
from openmm_cylchain.runs import configuration
from openmm_cylchain.runs.run import create_simulation
from openmm_cylchain.time_steps.precision import check_precision
from support.chain_energies import energies_of, exact_energies
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
# Of these, any vector register of single precision has all lanes filled.
FULL = 32


def actin(chains, segments=8, **options):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for chain in range(chains):
        filaments.add_equilibrium(F_ACTIN, segments, seed=chain + 1, start=[0, 0, 50.0 * chain], **options)
    return filaments


def context_of(filaments, precision="automatic", scheme="implicit", step=None, platform="Reference", seed=5, **options):
    _, system, positions = filaments.build()
    step = filaments.recommended_time_step(scheme, system=system) if step is None else step
    properties = options.pop("properties", {})
    integrator = filaments.create_integrator(
        system, step, scheme, random_seed=seed, precision=precision, checks=False, **options
    )
    context = new_context(system, positions, integrator, platform, properties)
    return context, integrator


def displacements_over(context, steps):
    before = positions_of(context)
    context.getIntegrator().step(steps)
    return positions_of(context) - before


def test_names_of_precisions():
    filaments = actin(1)
    _, system, _ = filaments.build()
    for name, value in PRECISIONS.items():
        assert filaments.create_integrator(system, 1e6, precision=name).getPrecision() == value
    assert filaments.create_integrator(system, 1e6).getPrecision() == CylinderChainIntegrator.Automatic
    for wrong in ("single", "Mixed", 1, None):
        with pytest.raises(InputError, match="precision must be one of automatic, mixed, double, but is"):
            filaments.create_integrator(system, 1e6, precision=wrong)
        with pytest.raises(InputError):
            check_precision(wrong)
    integrator = CylinderChainIntegrator(TEMPERATURE, 1.0, 1.0)
    assert integrator.getPrecision() == CylinderChainIntegrator.Automatic
    with pytest.raises(openmm.OpenMMException, match="Illegal precision: 3"):
        integrator.setPrecision(3)
    with pytest.raises(openmm.OpenMMException, match="not bound to a context"):
        integrator.getNumMixedPrecisionChains()


def test_portable_engine_refuses_mixed_precision():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_straight(F_ACTIN, 3, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match="portable engine computes filaments in double precision"):
        filaments.create_integrator(system, 1.0, precision="mixed")
    filaments.create_integrator(system, 1.0, precision="double")


def test_mixed_precision_of_beam_elements_alone_is_refused():
    kind = dataclasses.replace(F_ACTIN, segment_length=100.0, element="beam", extension_relaxation_time=None)
    for beside in (False, True):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        filaments.add_straight(kind, 3, [0, 0, 0], [1, 0, 0])
        if beside:
            filaments.add_straight(F_ACTIN, 3, [0, 50, 0], [1, 0, 0])
        _, system, _ = filaments.build()
        filaments.create_integrator(system, 1.0, precision="double")
        if beside:
            assert filaments.create_integrator(system, 1.0, precision="mixed").getPrecision() == PRECISIONS["mixed"]
            continue
        with pytest.raises(InputError, match="have beam elements, whose steps are in double precision: choose"):
            filaments.create_integrator(system, 1.0, precision="mixed")


def test_precision_is_serialized():
    integrator = CylinderChainIntegrator(TEMPERATURE, 1.0, 1.0)
    for value in PRECISIONS.values():
        integrator.setPrecision(value)
        assert copy.deepcopy(integrator).getPrecision() == value


def test_configuration_has_the_precision_of_filaments(tmp_path):
    text = (
        '[solvent]\ntemperature = "310 K"\nviscosity = "1 mPa s"\n'
        '[[filament]]\ntype = "F_ACTIN"\nsegments = 4\ncount = 2\n'
        '[simulation]\ntime_step = "1 us"\nduration = "4 us"\nreport_interval = "2 us"\nengine = "compiled"\n'
        'precision = "PRECISION"\n'
    )
    path = tmp_path / "run.toml"
    for name in ("automatic", "mixed", "double"):
        path.write_text(text.replace("PRECISION", name))
        settings = configuration.read_configuration(path)
        simulation, _ = create_simulation(settings)
        assert simulation.integrator.getPrecision() == PRECISIONS[name]
    path.write_text(text.replace("PRECISION", "single"))
    settings = configuration.read_configuration(path)
    with pytest.raises(InputError, match="precision cannot be chosen on the platform Reference"):
        create_simulation(settings)
    path.write_text(text.replace("PRECISION", "mixed").replace("compiled", "portable"))
    settings = configuration.read_configuration(path)
    with pytest.raises(InputError, match="precision cannot be chosen on the platform Reference"):
        create_simulation(settings)


@pytest.mark.parametrize("scheme", ["implicit", "implicit-second-order"])
def test_first_steps_are_those_of_double_precision(scheme):
    moves = {}
    for precision in ("mixed", "double"):
        context, integrator = context_of(actin(5), precision, scheme)
        moves[precision] = displacements_over(context, 3)
        assert integrator.getNumMixedPrecisionChains() == (5 if precision == "mixed" else 0)
    difference = np.abs(moves["mixed"] - moves["double"]).max() / np.abs(moves["double"]).max()
    assert 0.0 < difference < 1e-3


def test_halved_steps_follow_the_same_path():
    """Steps h and h/2 on one Brownian path end near each other; on two paths they would not."""
    step = 0.01 * actin(1).recommended_time_step("implicit").step
    ends = []
    for level in (0, 1):
        filaments = actin(5)
        _, system, positions = filaments.build()
        integrator = filaments.create_integrator(
            system, step / 2**level, random_seed=3, precision="mixed", checks=False
        )
        integrator.setPathLevel(level)
        context = new_context(system, positions, integrator)
        middles = displacements_over(context, 20 * 2**level).reshape(5, -1, 3).mean(axis=1)
        assert integrator.getNumMixedPrecisionChains() == 5
        ends.append(middles)
    assert np.abs(ends[0] - ends[1]).max() < 0.02 * np.abs(ends[0]).max()


def test_energies_and_diffusion_of_actin():
    segments, steps, every = 8, 1000, 2
    filaments = actin(4 * FULL, segments)
    context, integrator = context_of(filaments)
    integrator.step(60)
    assert integrator.getNumMixedPrecisionChains() == 4 * FULL
    samples, moves = [], []
    weights = np.ones(segments + 1)
    weights[[0, -1]] = 0.5
    for _ in range(steps // every):
        before = positions_of(context).reshape(4 * FULL, -1, 3)
        integrator.step(every)
        after = positions_of(context).reshape(4 * FULL, -1, 3)
        samples.append(energies_of(F_ACTIN, after))
        moves.append(((np.average(after - before, axis=1, weights=weights)) ** 2).sum(axis=1))
    for values, exact in zip(np.mean(samples, axis=0), exact_energies(F_ACTIN)):
        error = values.std(ddof=1) / np.sqrt(len(values)) / exact
        assert SIGMAS * error < 0.01
        assert abs(values.mean() / exact - 1.0) < 0.01 + SIGMAS * error
    # The centre of friction moves as that of free segments do.
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE, segments)
    step = every * integrator.getStepSize()._value
    expected = 2.0 * KT * step * (1.0 / friction.parallel + 2.0 / friction.perpendicular) / segments
    by_chain = np.mean(moves, axis=0)
    assert abs(by_chain.mean() / expected - 1.0) < 0.03 + SIGMAS * by_chain.std() / np.sqrt(len(by_chain)) / expected
    assert integrator.getNumDividedSteps() <= 1e-3 * steps * 4 * FULL


def test_place_in_space_does_not_matter():
    moves = []
    for shift in (0.0, 131072.0):
        context, integrator = context_of(actin(3), "mixed")
        # Steps of 2^-20 nm, which such a shift does not round.
        positions = np.round(positions_of(context) * 2**20) / 2**20 + shift
        context.setPositions(positions)
        integrator.step(1)
        moves.append(positions_of(context) - positions)
    assert np.abs(moves[0] - moves[1]).max() < 1e-9


@pytest.mark.parametrize("precision", ["automatic", "mixed"])
def test_checkpoint_restart_is_bit_identical(precision):
    context, integrator = context_of(actin(FULL + 3), precision)
    integrator.step(7)
    checkpoint = context.createCheckpoint()
    integrator.step(40)
    expected = positions_of(context)
    restarted, again = context_of(actin(FULL + 3), precision)
    restarted.loadCheckpoint(checkpoint)
    again.step(40)
    assert np.array_equal(positions_of(restarted), expected)
    assert again.getNumMixedPrecisionChains() >= FULL


def test_threads_platforms_and_records_change_no_bit():
    ends = []
    for platform, properties in (("Reference", {}), ("CPU", {"Threads": "1"}), ("CPU", {"Threads": "3"})):
        context, integrator = context_of(actin(3 * FULL + 1), platform=platform, properties=properties)
        integrator.setRecordsTensions(platform == "Reference")
        integrator.step(11)
        assert integrator.getNumMixedPrecisionChains() >= 3 * FULL
        ends.append(positions_of(context))
    assert np.array_equal(ends[0], ends[1])
    assert np.array_equal(ends[0], ends[2])


def test_each_step_chooses_anew():
    filaments = actin(FULL)
    context, integrator = context_of(filaments)
    step = integrator.getStepSize()
    assert integrator.getNumMixedPrecisionChains() == 0

    def mixed():
        integrator.step(2)
        return integrator.getNumMixedPrecisionChains()

    assert mixed() == FULL
    integrator.setStepSize(1e5 * step)
    assert mixed() == 0
    integrator.setStepSize(step)
    assert mixed() == FULL
    integrator.setTemperature(0 * unit.kelvin)
    assert mixed() == 0
    integrator.setTemperature(TEMPERATURE * unit.kelvin)
    integrator.setFlow(Flow.shear(1.0 / unit.second))
    assert mixed() == 0
    integrator.setFlow(None)
    assert mixed() == FULL
    integrator.setPrecision(CylinderChainIntegrator.Double)
    assert mixed() == 0
    integrator.setPrecision(CylinderChainIntegrator.Mixed)
    assert mixed() == FULL
    assert np.all(np.isfinite(positions_of(context)))


def test_few_filaments_are_mixed_only_if_asked_for():
    for precision, expected in (("automatic", 0), ("mixed", 1), ("double", 0)):
        context, integrator = context_of(actin(1), precision)
        integrator.step(3)
        assert integrator.getNumMixedPrecisionChains() == expected, precision


def test_rings_and_fene_are_in_double_precision():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    fene = dataclasses.replace(F_ACTIN, stretching_model="fene", maximum_extension=100.0)
    for _ in range(FULL):
        filaments.add_straight(fene, 4, [0, 0, 0], [1, 0, 0])
        filaments.add_ring(F_ACTIN, 8, [0, 0, 0], [0, 0, 1])
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    context, integrator = context_of(filaments, "mixed", step=1e6)
    integrator.step(2)
    assert integrator.getNumMixedPrecisionChains() == 1
    assert np.all(np.isfinite(positions_of(context)))
