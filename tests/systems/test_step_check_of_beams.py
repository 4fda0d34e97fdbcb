"""The check of a step, for filaments of beam elements: steps that are right, and some that are far too long."""

from dataclasses import replace

import pytest

from openmm_cylchain import F_ACTIN, Filaments, check_time_step
from openmm_cylchain.cli import main
from support.linked_beams import BEAM
from support.solvent import TEMPERATURE, VISCOSITY


def free_beams(kind, count, elements):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(count):
        filaments.add_equilibrium(kind, elements, seed=number + 1)
    return filaments, *filaments.build()[1:]


def test_the_recommended_step_of_beams_is_right():
    """All averages beside those of a quarter of the step, on one path, and the exact ones of free chains."""
    filaments, system, positions = free_beams(BEAM, 100, 3)
    step = filaments.recommended_time_step()
    check = check_time_step(filaments, system, positions, step, frames=160, parts=4, equilibrium=True)
    assert check.verdict == "right", str(check)
    names = [one.name.removeprefix("BEAM ") for one in check.observables]
    assert names[:3] == ["stretching energy", "bending energy", "end to end, mean square"] and len(names) == 6
    for one in check.observables[:3]:
        assert one.judged_by_exact and abs(one.deviation) < 0.01 + 4 * one.deviation_standard_error
        assert one.deviation_standard_error < 0.0125
    gains = {one.name: one.unpaired_standard_error / one.standard_error for one in check.observables}
    assert gains["BEAM end to end, mean square"] > 1.5, gains
    assert check.relaxation > 0.0


@pytest.mark.slow
def test_a_step_that_is_far_too_long_is_wrong():
    """Soft elements, which turn far: with sixty times the recommended step, they keep to neither energy nor length."""
    kind = replace(BEAM, bending_rigidity=None, persistence_length=300.0, temperature=TEMPERATURE)
    filaments, system, positions = free_beams(kind, 60, 2)
    step = 60.0 * filaments.recommended_time_step().step
    check = check_time_step(filaments, system, positions, step, frames=150, equilibrium=True)
    assert check.verdict == "wrong", str(check)
    assert check.divided[0] > 0.01


def test_tethers_and_straight_filaments_are_looked_at_as_well():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(8):
        filaments.add_tether(filaments.add_equilibrium(BEAM, 2, seed=number), 0, [0, 0, 0], 0.1)
        filaments.add_equilibrium(F_ACTIN, 3, seed=number)
    _, system, positions = filaments.build()
    check = check_time_step(filaments, system, positions, 1e5, frames=40)
    names = {one.name for one in check.observables}
    assert {"tethers", "BEAM x 2 bending energy", "ACT x 3 bending energy"} <= names
    assert all(one.exact is None for one in check.observables)


def test_the_command_checks_files_with_beams(tmp_path, capsys):
    (tmp_path / "input.toml").write_text(
        """
        [solvent]
        temperature = "310 K"
        viscosity = "1.71 mPa*s"

        [[filament]]
        type = "F_ACTIN"
        element = "beam"
        segments = 2
        count = 8

        [simulation]
        time_step = "recommended"
        duration = "1 s"
        report_interval = "100 ms"
        """
    )
    assert main(["timestep", str(tmp_path / "input.toml"), "--check", "--seconds", "2"]) == 0
    assert "ACT bending energy" in capsys.readouterr().out


@pytest.mark.parametrize("planar", [False, True])
def test_planar_beams_have_no_exact_averages(planar):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(2):
        filaments.add_equilibrium(BEAM, 2, seed=number, planar=planar)
    _, system, positions = filaments.build()
    check = check_time_step(filaments, system, positions, 1e5, frames=20)
    assert [one.exact is None for one in check.observables[:3]] == [planar] * 3
