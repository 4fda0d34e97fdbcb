"""A run that checks its own step: steps that are wrong and right, errors that are known, error bars, the command."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    Filaments,
    Flow,
    InputError,
    Plane,
    capsule_contact_force,
    check_time_step,
    filament_wall_force,
)
from openmm_cylchain.cli import main
from openmm_cylchain.couplings import pulling
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.run import check_step
from openmm_cylchain.systems.step_check_results import ObservableCheck
from support.solvent import KT, TEMPERATURE, VISCOSITY

REFERENCE = openmm.Platform.getPlatform("Reference")


def free_filaments(count, segments=16, kind=F_ACTIN, engine=None):
    """Filaments in equilibrium that do not interact, with their middles in one place."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for number in range(count):
        drawn = Filaments(VISCOSITY, TEMPERATURE)
        drawn.add_equilibrium(kind, segments, seed=number + 1)
        filaments.add_nodes(kind, drawn[0].positions - drawn[0].positions[segments // 2])
    _, system, positions = filaments.build()
    return filaments, system, positions


def bound_particles(bonds, engine=None):
    """Pairs of particles with springs of length zero, beside a filament of one segment; k = 1, friction = 1."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    force = openmm.HarmonicBondForce()
    for _ in range(bonds):
        first = system.addParticle(1.0)
        force.addBond(first, system.addParticle(1.0), 0.0, 1.0)
    system.addForce(force)
    extensions = np.random.default_rng(3).normal(scale=np.sqrt(KT), size=(bonds, 3))
    others = np.stack([np.zeros((bonds, 3)), extensions], axis=1).reshape(-1, 3)
    return filaments, system, np.concatenate([positions._value, others])


def springs_of(check):
    return next(one for one in check.observables if one.name.startswith("HarmonicBondForce"))


def test_step_for_filaments_alone_is_wrong_for_a_stiff_bond():
    filaments, system, positions = free_filaments(24, segments=8)
    force = openmm.HarmonicBondForce()
    for first, second in zip(filaments.node_indices[::2], filaments.node_indices[1::2]):
        force.addBond(int(first[4]), int(second[4]), 0.0, 8e-4)
    system.addForce(force)
    alone, right = filaments.recommended_time_step(), filaments.recommended_time_step(system=system)
    assert 8 < alone.step / right.step < 12
    check = check_time_step(filaments, system, positions, alone, frames=160, platform=REFERENCE)
    bond = springs_of(check)
    assert bond.verdict == check.verdict == "wrong"
    assert bond.error > 0.1 and bond.standard_error < 0.02
    assert "wrong by" in str(check) and "HarmonicBondForce" in check.explanation()
    check = check_time_step(filaments, system, positions, right, frames=160, platform=REFERENCE)
    assert springs_of(check).verdict == "right"
    assert 0.0 < springs_of(check).error <= 0.05 + 4 * springs_of(check).standard_error


def test_recommended_step_of_actin_is_right():
    filaments, system, positions = free_filaments(32)
    step = filaments.recommended_time_step()
    check = check_time_step(filaments, system, positions, step, frames=160, equilibrium=True, platform=REFERENCE)
    assert check.verdict != "wrong" and check["ACT bending energy"].verdict == "right", str(check)
    assert len(check.observables) == 7 and check.windows == 16 and check.frames == 10
    for one in check.observables[:3]:
        assert abs(one.deviation) < 4 * one.deviation_standard_error
        assert one.deviation_standard_error < 0.0125
    # Filaments keep to their path, so that what they have in common with it is no noise.
    gains = {one.name: one.unpaired_standard_error / one.standard_error for one in check.observables}
    assert gains["ACT end to end, mean square"] > 4, gains
    assert gains["ACT bending mode 1, change"] > 2 and gains["ACT middle, displacement"] > 2, gains


@pytest.mark.parametrize("rate, parts", [(0.1, 16), pytest.param(0.6, 16, marks=pytest.mark.slow), (1.0, 16), (0.6, 2)])
def test_error_of_a_spring_is_that_of_theory(rate, parts):
    filaments, system, positions = bound_particles(300)
    # Two particles of friction one relax with 2 k.
    check = check_time_step(
        filaments,
        system,
        positions,
        0.5 * rate,
        scheme="midpoint",
        particle_friction=1.0,
        frames=300,
        parts=parts,
        platform=REFERENCE,
    )
    bond = springs_of(check)
    exact = [1.5 * 300 / (1.0 - 0.5 * rate / each) for each in (1, parts)]
    assert bond.values == pytest.approx(exact, rel=4 * 0.005)
    expected = (exact[0] / exact[1] - 1.0) * parts / (parts - 1)
    assert bond.error == pytest.approx(expected, abs=4 * bond.standard_error)
    assert bond.standard_error < 0.02


@pytest.mark.slow
def test_standard_errors_are_right():
    filaments, system, positions = bound_particles(60)
    found = []
    for seed in range(1, 25):
        check = check_time_step(
            filaments,
            system,
            positions,
            0.2,
            scheme="midpoint",
            particle_friction=1.0,
            frames=86,
            random_seed=seed,
            platform=REFERENCE,
        )
        found.append((springs_of(check).error, springs_of(check).standard_error))
    errors, bars = np.array(found).T
    # The largest of two estimates is a little too large. The spread of 24 errors is known to 15 %.
    assert 0.4 < errors.std(ddof=1) / bars.mean() < 1.3
    assert errors.mean() == pytest.approx(1.0 / (1.0 - 0.2) - 1.0, abs=4 * errors.std(ddof=1) / np.sqrt(24))


def test_portable_engine_compares_independent_runs():
    settings = {"scheme": "midpoint", "particle_friction": 1.0, "frames": 64, "platform": REFERENCE}
    checks = [
        check_time_step(*bound_particles(100, engine), 0.4, parts=2, **settings) for engine in ("portable", "compiled")
    ]
    assert not checks[0].paired and checks[1].paired
    assert "independent paths" in str(checks[0])
    bonds = [springs_of(check) for check in checks]
    for bond in bonds:
        assert bond.error == pytest.approx(1.0 / (1.0 - 0.4) - 1.0, abs=4 * bond.standard_error)
    assert bonds[0].standard_error / bonds[0].unpaired_standard_error == pytest.approx(1.0, abs=0.5)
    assert bonds[1].standard_error < 0.7 * bonds[0].standard_error


def test_error_that_no_step_removes_is_seen_by_exact_averages():
    kind = F_ACTIN.with_segment_length(60)
    arguments = *free_filaments(16, 8, kind), Filaments(VISCOSITY, TEMPERATURE)
    step = arguments[0].recommended_time_step("euler")
    settings = {"scheme": "euler", "frames": 400, "platform": REFERENCE}
    check = check_time_step(*arguments[:3], step, equilibrium=True, **settings)
    lengths = check["ACT stretching energy"]
    assert lengths.exact == pytest.approx(0.5, rel=1e-3)
    assert abs(lengths.error) < 0.1 < lengths.deviation
    assert lengths.off_exact and lengths.verdict == check.verdict == "wrong"
    assert "off the exact value" in str(check)
    check = check_time_step(*arguments[:3], step, **settings)
    assert not check["ACT stretching energy"].off_exact
    assert "Off their exact values are ACT stretching energy" in str(check)


def test_result_is_the_same_each_time_and_the_system_is_left_alone():
    filaments, system, positions = free_filaments(3, 4)
    system.addForce(openmm.CMMotionRemover())
    before = openmm.XmlSerializer.serialize(system)
    step = 10 * unit.nanosecond
    checks = [
        check_time_step(filaments, system, positions, each, scheme="midpoint", frames=30, platform=REFERENCE)
        for each in (step, 1e4)
    ]
    assert [one.values for one in checks[0].observables] == [one.values for one in checks[1].observables]
    assert openmm.XmlSerializer.serialize(system) == before


def test_everything_that_moves_is_listed():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_ring(F_ACTIN, 8, [0, 0, 0], planar=True)
    filaments.add_straight(F_ACTIN, 3, [0, 0, 50], [1, 0, 0], clamped=[0, 1])
    filaments.add_straight(F_ACTIN, 3, [0, 0, 100], [1, 0, 0], propulsion=0.1)
    filaments.add_straight(F_ACTIN, 1, [0, 0, 200], [1, 0, 0])
    filaments.add_tether(2, 0, [0, 0, 100], 0.01)
    _, system, positions = filaments.build()
    system.addForce(openmm.CMMotionRemover())
    system.addForce(pulling.constant_force([9], [0.1, 0, 0]))
    wall = openmm.CustomExternalForce("0.001*(z-50)^2")
    wall.addParticle(10, [])
    system.addForce(wall)
    check = check_time_step(
        filaments,
        system,
        positions,
        1e5,
        frames=20,
        flow=Flow.shear(1e-9),
        platform=REFERENCE,
        temperature=300 * unit.kelvin,
    )
    names = [one.name for one in check.observables]
    assert names[:4] == [
        "ACT x 8 stretching energy",
        "ACT x 8 bending energy",
        "ACT x 8 across, mean square",
        "ACT x 8 middle, displacement",
    ]
    assert "ACT x 3 bending mode 2, change" in names and "ACT x 3 (filament 2) bending mode 2, change" in names
    assert "ACT x 1 stretching energy" in names and "ACT x 1 bending energy" not in names
    assert names[-2:] == ["tethers", "CustomExternalForce (force 3)"]
    assert all(np.isfinite(one.error) and one.exact is None for one in check.observables)
    assert check.scheme == "implicit" and check["tethers"].name == "tethers"
    with pytest.raises(KeyError, match="tethers"):
        check["walls"]


def test_run_that_blows_up_is_wrong():
    filaments, system, positions = free_filaments(2, 8)
    check = check_time_step(filaments, system, positions, 1e6, scheme="midpoint", frames=100, platform=REFERENCE)
    assert check.verdict == "wrong" and "blown up" in check.failure and check.failure in str(check)
    assert check.observables == []
    # Springs that grow by 5 % in each step have no error bar before they blow up.
    settings = {"scheme": "midpoint", "particle_friction": 1.0, "platform": REFERENCE}
    growing = check_time_step(*bound_particles(20), 1.025, frames=100, **settings)
    assert growing.verdict == springs_of(growing).verdict == "wrong" and "grows without bound" in str(growing)
    assert max(map(len, str(growing).splitlines())) < 150
    json.dumps(growing.as_dict(), allow_nan=False)
    beyond = check_time_step(*bound_particles(20), 4.0, frames=400, **settings)
    assert beyond.verdict == "wrong" and "blown up" in beyond.failure


def test_check_of_a_single_frame_says_so():
    filaments, system, positions = free_filaments(2, 4)
    check = check_time_step(filaments, system, positions, 1e7, seconds=1e-9, platform=REFERENCE)
    assert check.frames == 1 and check.verdict == "not resolved" and "too few steps" in str(check)


def test_check_keeps_to_its_time():
    told = []
    start = time.monotonic()
    check = check_time_step(*free_filaments(2, 8), 1e7, seconds=0.5, platform=REFERENCE, say=told.append)
    assert 0.5 <= check.seconds <= time.monotonic() - start < 10.0
    assert told[-1].startswith("100 %") and len(told) <= 10


def test_short_check_is_not_resolved():
    filaments, system, positions = free_filaments(2, 8)
    check = check_time_step(filaments, system, positions, 1e7, frames=40, platform=REFERENCE)
    assert check.verdict == "not resolved"
    assert "run about" in str(check) and "run longer" not in str(check)
    assert "slowest bends relax" in str(check)
    assert json.loads(json.dumps(check.as_dict(), allow_nan=False))["verdict"] == "not resolved"


def crowd():
    """Filaments that motors join and pull about: slow to forget which hands are bound."""
    configuration = """
    [solvent]
    temperature = "300 K"
    viscosity = "10 mPa*s"
    [box]
    edges = ["400 nm", "400 nm", "400 nm"]
    [[filament]]
    type = "F_ACTIN"
    segment_length = "100 nm"
    segments = 3
    propulsion = "0.02 pN"
    count = 4
    [[linkers]]
    name = "m"
    stiffness = "0.1 pN/nm"
    rest_length = "30 nm"
    hand.binding_rate = "500 1/s"
    hand.reach = "60 nm"
    hand.unbinding_rate = "50 1/s"
    hand.speed = "2 um/s"
    hand.stall_force = "4 pN"
    count = 40
    [simulation]
    time_step = "20 us"
    duration = "1 ms"
    report_interval = "1 ms"
    """
    built = build_system(parse_configuration(configuration), "compiled", 1)
    return built.filaments, built.system, built.positions


@pytest.mark.parametrize("seeds", [3, pytest.param(12, marks=pytest.mark.slow)])
def test_right_steps_of_linkers_are_not_called_wrong(seeds):
    """They bind and unbind more slowly than a window lasts, which error bars must not be deceived by."""
    errors, bars = [], []
    for seed in range(1, seeds + 1):
        check = check_time_step(*crowd(), 2e7, frames=96, parts=4, random_seed=seed, platform=REFERENCE)
        assert check.verdict != "wrong", str(check)
        assert check["hands that are bound"].values[0] > 10.0
        # Where no linker has ever joined two filaments, there is nothing to compare.
        if "Linkers (force 1)" in [one.name for one in check.observables]:
            linkers = check["Linkers (force 1)"]
            errors.append(linkers.error)
            bars.append(linkers.standard_error)
    assert len(errors) >= seeds - seeds // 12
    assert np.sqrt(np.mean(np.square(errors) / np.square(bars))) < (1.7 if seeds > 3 else 3.0)


def pressed_particles(stiffness):
    """Particles on a filament that hardly moves, each held by a trap within its contact, and a wall beside all."""
    count, diameter = 40, 20.0
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN.with_segment_length(100), count, [0, 0, 0], [1, 0, 0], clamped=range(count))
    topology, system, positions = filaments.build()
    centers = np.zeros((count, 3))
    centers[:, 0], centers[:, 1] = 50.0 + 100.0 * np.arange(count), 0.9 * diameter
    particles = [system.addParticle(1.0) for _ in range(count)]
    trap = openmm.CustomExternalForce("0.5*k*((x-x0)^2+(y-y0)^2+(z-z0)^2)")
    trap.addGlobalParameter("k", 0.1 * stiffness)
    for name in ("x0", "y0", "z0"):
        trap.addPerParticleParameter(name)
    for particle, center in zip(particles, centers):
        trap.addParticle(particle, list(center))
    system.addForce(trap)
    system.addForce(capsule_contact_force(filaments, system, diameter, stiffness, particles, diameter))
    wall = Plane([0, 0, 0], [0, 0, 1])
    system.addForce(filament_wall_force(filaments, system, wall, stiffness, particles=particles))
    return filaments, system, np.concatenate([positions._value, centers])


def test_walls_contacts_and_particles_are_looked_at():
    stiffness, friction = 1.0, 1.0
    arguments = pressed_particles(stiffness)
    settings = {"scheme": "midpoint", "particle_friction": friction, "platform": REFERENCE}
    # lambda h = 1.2: the energies of explicit contacts and walls are up to 2.5 times as large.
    wrong = check_time_step(*arguments, 1.2 * friction / stiffness, frames=160, **settings)
    right = check_time_step(*arguments, 0.02 * friction / stiffness, frames=160, **settings)
    for name in ("CylinderChainContactForce (force 2)", "CylinderChainWallForce (plane) (force 3)"):
        assert wrong[name].verdict == "wrong" and wrong[name].error > 0.2, str(wrong)
        assert right[name].verdict != "wrong" and abs(right[name].error) < 0.05 + right[name].error_bar, str(right)
    assert wrong["particles, displacement"].verdict == "wrong"
    assert wrong.verdict == "wrong" and right.verdict != "wrong"
    assert "particles, from where they began" in [one.name for one in right.observables]


@pytest.mark.slow
def test_filaments_that_buckle_too_slowly_are_wrong():
    """At 100 times Euler's load, with a step that is right for the filament without it."""
    kind, segments = F_ACTIN.with_segment_length(250), 24
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(4):
        filaments.add_straight(kind, segments, [0, 1e4 * number, 0], [1, 0, 0])
    load = 100.0 * np.pi**2 * kind.bending_rigidity / (segments * 250.0) ** 2
    _, system, positions = filaments.build()
    system.addForce(pulling.constant_tension(filaments, -load, [1, 0, 0]))
    right = filaments.recommended_time_step("implicit", system=system).step
    checks = [
        check_time_step(filaments, system, positions, step, frames=16, parts=8, platform=REFERENCE)
        for step in (20.0 * right, right)
    ]
    growth = checks[0]["ACT bends, time to grow"]
    assert growth.verdict == checks[0].verdict == "wrong" and growth.error > 0.3, str(checks[0])
    assert checks[1].verdict != "wrong", str(checks[1])


def test_a_strained_start_is_told():
    filaments, system, positions = free_filaments(2, 8)
    step = filaments.recommended_time_step().step
    system.addForce(filament_wall_force(filaments, system, Plane([0, 0, 1500], [0, 0, 1]), 0.01))
    check = check_time_step(filaments, system, positions, step, frames=32, parts=2, platform=REFERENCE)
    assert check.strained == ("CylinderChainWallForce (plane) (force 1)",), str(check)
    assert "The start is strained" in str(check)


def test_rule():
    def observable(error, standard_error, **others):
        unknown = {"exact": None, "deviation": None, "deviation_standard_error": None, "judged_by_exact": False}
        return ObservableCheck("x", "1", (1.0, 1.0), error, standard_error, 1.0, seconds=10.0, **(unknown | others))

    assert observable(0.04, 0.01).explanation() == "right within 8 %"
    assert observable(-0.20, 0.03).explanation() == "wrong by -20 % +- 3 %"
    assert observable(0.0, 0.025).explanation() == "not resolved: error bar 10 %, run about 40 s"
    assert observable(0.0, 0.5).explanation() == "not resolved: error bar 200 %, run about 16000 s"
    assert observable(0.08, 0.01).verdict == "not resolved"
    assert observable(0.08, 0.01).required_seconds == pytest.approx(10 * (0.04 / 0.03) ** 2)
    few = observable(0.0, 0.01, degrees=15.0)
    assert few.error_bar == pytest.approx(0.0548, abs=1e-4) and observable(0.0, 0.01).error_bar == pytest.approx(0.04)
    assert observable(0.5, np.inf).verdict == "not resolved"
    assert observable(101.0, np.inf).verdict == observable(np.nan, np.nan).verdict == "wrong"
    off = {"exact": 1.0, "deviation": 0.3, "deviation_standard_error": 0.01, "judged_by_exact": True}
    assert observable(0.0, 0.001, **off).verdict == "wrong"
    assert observable(0.0, 0.001, **(off | {"judged_by_exact": False})).verdict == "right"
    assert observable(0.0, 0.001, **(off | {"deviation_standard_error": np.inf})).verdict == "right"


def test_wrong_input_is_refused():
    filaments, system, positions = free_filaments(1, 2)
    for changes, message in (
        ({"parts": 12}, "parts must be a power of two"),
        ({"temperature": 0}, "temperature of zero"),
        ({"frames": 1}, "frames"),
        ({"seconds": -1.0}, "seconds"),
        ({"random_seed": 0}, "random_seed"),
        ({"scheme": "verlet"}, "scheme must be one of"),
    ):
        with pytest.raises(InputError, match=message):
            check_time_step(filaments, system, positions, 1e4, **changes)


CONFIGURATION = """
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
type = "F_ACTIN"
segments = 4
count = 8
start = "equilibrium"
[simulation]
scheme = "midpoint"
time_step = "100 ns"
duration = "1 ms"
report_interval = "100 us"
"""


def configured(tmp_path, *changes):
    text = CONFIGURATION
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "input.toml"
    path.write_text(text)
    return str(path)


def test_command_finds_a_wrong_step(tmp_path, capsys):
    # lambda h = 1 for the length of a segment.
    path, result = configured(tmp_path), tmp_path / "check.json"
    assert main(["timestep", path, "--check", "--seconds", "1", "--json", str(result)]) == 3
    out, progress = capsys.readouterr()
    assert "recommended" in out and "The step of 100 ns is wrong: ACT stretching energy" in out
    assert "100 %" in progress and out.isascii()
    content = json.loads(result.read_text())
    assert content["verdict"] == "wrong" and content["paired"] is True
    lengths = content["observables"][0]
    assert lengths["name"] == "ACT stretching energy" and lengths["verdict"] == "wrong"
    assert lengths["deviation"] > 0.5 and lengths["judged_by_exact"]


def test_command_passes_a_right_step_and_warns_of_one_that_it_cannot_tell(tmp_path, capsys):
    path = configured(tmp_path, ('"midpoint"', '"implicit"'), ('"100 ns"', '"recommended"'))
    assert main(["timestep", path, "--check", "--seconds", "0.05"]) == 0
    out, errors = capsys.readouterr()
    assert "Not resolved" in out and "warning: the step is not known to be right" in errors
    for arguments in (["--seconds", "1"], ["--json", "check.json"]):
        assert main(["timestep", path, *arguments]) == 2
        assert "belong to --check" in capsys.readouterr().err
    assert main(["timestep", path, "--check", "--seconds", "-1"]) == 2
    assert main(["timestep", path, "--check", "--json", str(tmp_path / "none" / "check.json")]) == 2


def test_exact_averages_count_only_from_equilibrium(tmp_path):
    text = (CONFIGURATION.replace('"equilibrium"', '"straight"'), CONFIGURATION)
    judged = [
        [one.judged_by_exact for one in check_step(parse_configuration(each), seconds=0.3).observables] for each in text
    ]
    assert not any(judged[0]) and judged[1][:3] == [True, True, True] and not any(judged[1][3:])


def test_command_ends_cleanly_when_interrupted(tmp_path):
    # Of the portable engine, which runs Python within a step.
    path = configured(tmp_path, ("[simulation]", '[simulation]\nengine = "portable"'))
    command = [sys.executable, "-c", "from openmm_cylchain.cli import main; exit(main())", "timestep", path, "--check"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": tmp_path}
    process = subprocess.Popen([*command, "--seconds", "60"], **pipes)
    # Printed before the check begins.
    while "in this configuration" not in process.stdout.readline():
        assert process.poll() is None
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "interrupted" in errors and "Traceback" not in errors
