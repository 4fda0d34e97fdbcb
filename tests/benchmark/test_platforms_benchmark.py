"""The benchmark of platforms: its systems, its rows from given timings, and that it runs."""

import json

import numpy as np
import openmm
import pytest
from openmm import unit

from benchmark import platforms
from benchmark.platforms import ChainsSize, Effort, MixedSize
from command_line import main
from openmm_cylchain import InputError, stokes_friction
from support.contexts import forces_of, new_context, positions_of
from support.platforms import GPU_CASES

SMALL = (ChainsSize(3, 10), MixedSize(60, 5))


def test_mixed_system_is_what_it_says():
    system, positions, integrator = platforms.mixed_system(60, 5)
    assert system.getNumParticles() == 60 + 5 * 11
    (attraction,) = [force for force in system.getForces() if isinstance(force, openmm.NonbondedForce)]
    _, sigma, epsilon = attraction.getParticleParameters(0)
    assert sigma == 100 * unit.nanometer
    assert epsilon.value_in_unit(unit.kilojoule_per_mole) == pytest.approx(8.31446261815324e-3 * 310)
    lattice = positions.value_in_unit(unit.nanometer)[:60]
    between = np.linalg.norm(lattice[:, None] - lattice[None], axis=2)[np.triu_indices(60, 1)]
    assert between.min() == pytest.approx(120.0)
    context = new_context(system, positions, integrator)
    start, box = (
        positions_of(context),
        np.diag([tuple(vector._value) for vector in system.getDefaultPeriodicBoxVectors()]),
    )
    between = start[:60, None] - start[None]
    between -= box * np.round(between / box)
    distances = np.linalg.norm(between, axis=2)
    near = (distances > 0) & (distances < 250.0)
    share = (100.0 / np.where(near, distances, 1.0)) ** 6
    strength = np.where(
        near,
        24 * epsilon.value_in_unit(unit.kilojoule_per_mole) * (2 * share**2 - share) / distances.clip(1.0) ** 2,
        0.0,
    )
    expected = (strength[:, :, None] * between).sum(axis=1)
    np.testing.assert_allclose(forces_of(context)[:60], expected, atol=1e-9)
    assert np.abs(expected).max() > 0.01
    before = positions_of(context)
    integrator.step(20)
    moved = positions_of(context) - before
    assert 1.0 < np.abs(moved[:60]).max() < 100.0
    assert np.abs(moved[60:]).max() > 0.1


def test_sizes_are_those_that_the_page_names():
    names = [size.name for size in platforms.FULL.sizes]
    assert names[:2] == ["200_chains_of_64", "200_chains_of_10"]
    assert names[-1] == "100000_particles_and_100_filaments"


def test_rows_are_ratios_to_the_cpu():
    times = {"cpu": np.array([4e-3, 4e-3, 8e-3]), "opencl_mixed": np.array([1e-3, 2e-3, 2e-3])}
    rows = {row.name: row for row in platforms.platform_rows("few", times)}
    assert rows["time_per_step_few_cpu"].value == pytest.approx(4.0)
    assert rows["time_per_step_few_opencl_mixed"].value == pytest.approx(2.0)
    assert rows["speed_over_cpu_few_opencl_mixed"].value == pytest.approx(4.0)
    assert len(rows) == 3
    alone = platforms.platform_rows("few", {"opencl_mixed": times["opencl_mixed"]})
    assert [row.name for row in alone] == ["time_per_step_few_opencl_mixed"]


def test_rows_of_added_filaments_are_ratios_to_the_particles_alone():
    times = {("gpu", 0, "steps"): np.array([4e-3, 4e-3, 8e-3]), ("gpu", 1, "steps"): np.array([2e-3, 2e-3, 4e-3])}
    (ratio,) = platforms.added_rows(50, times)
    assert ratio.name == "steps_with_10_filaments_over_without_50_particles_gpu"
    assert ratio.value == pytest.approx(2.0)


def test_particles_alone_diffuse_as_those_beside_filaments():
    context = platforms.particles_alone(60, "Reference", {})
    mobility = 1 / stokes_friction(0.5 * platforms.DIAMETER, platforms.VISCOSITY)
    expected = positions_of(context) + platforms.MIXED_TIME_STEP * mobility * forces_of(context)
    context.getIntegrator().step(1)
    moved = positions_of(context) - expected
    variance = 2 * 8.31446261815324e-3 * 310 * platforms.MIXED_TIME_STEP * mobility
    assert np.mean(moved**2) == pytest.approx(variance, rel=4 * np.sqrt(2 / 180))


def test_platforms_that_are_not_there_are_missing_with_the_reason(monkeypatch):
    def refuse(name):
        raise InputError(f"no {name} today")

    monkeypatch.setattr(platforms, "why_not_on", lambda name: "no driver" if name == "CUDA" else None)
    monkeypatch.setattr(platforms, "enable_platform", refuse)
    found, missing = platforms.places()
    assert list(found) == ["cpu"]
    assert missing == {"OpenCL": "no OpenCL today", "CUDA": "no driver", "HIP": "no HIP today"}


def _run(monkeypatch, tmp_path):
    monkeypatch.setattr(platforms, "QUICK", Effort(SMALL, 60, 2, 1e-3))
    path = tmp_path / "result.json"
    assert main(["benchmark", "platforms", "--quick", "--json", str(path)]) == 0
    content = json.loads(path.read_text())
    return content, {row["name"]: row["value"] for row in content["rows"]}


def test_benchmark_without_a_gpu(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(platforms, "why_not_on", lambda name: "there is none")
    content, rows = _run(monkeypatch, tmp_path)
    added = {f"{way}_with_10_filaments_over_without_60_particles_cpu" for way in ("steps", "energies")}
    assert set(rows) == added | {f"time_per_step_{size.name}_cpu" for size in SMALL}
    assert min(rows.values()) > 0
    assert content["settings"]["devices"] == {"CPU": "the processor"}
    assert "HIP missing: there is none" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(not GPU_CASES, reason="no platform for GPUs is here")
def test_benchmark_in_all_precisions(monkeypatch, tmp_path):
    content, rows = _run(monkeypatch, tmp_path)
    for size in SMALL:
        for case in GPU_CASES:
            assert rows[f"speed_over_cpu_{size.name}_{case.name.lower()}_{case.precision}"] > 0
    assert content["settings"]["devices"][GPU_CASES[0].name]
