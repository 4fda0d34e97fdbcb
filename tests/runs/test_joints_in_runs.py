"""[[joint]] tables: what is built of them, what is refused with its line, and runs whose joints hold."""

import re

import numpy as np
import openmm
import pytest

from openmm_cylchain import InputError, analysis
from openmm_cylchain.beams.curve import element_slopes
from openmm_cylchain.cli import main
from openmm_cylchain.runs.configuration import changed_keys, parse_configuration
from openmm_cylchain.runs.initial_state import build_system
from support.configurations import BEAMS
from support.contexts import energy_of, new_context
from support.small_runs import simulated

PLAIN = re.sub(r"\[\[joint\]\].*(?=\[simulation\])", "", BEAMS, flags=re.DOTALL)
# Filaments 0 and 1 have three elements of 1 um, filament 2 has two, and begins along (1, 0.5, 0).
JOINT = """
[[joint]]
between = [{ filament = 0, arc_length = "1.25 um" }, { filament = 1, node = -1 }]
stiffness = "400 kJ/mol"
angle = "40 deg"
"""


def with_joint(joint=JOINT):
    return PLAIN.replace("[simulation]", f"{joint}[simulation]")


def changed(old, new):
    joint = JOINT.replace(old, new, 1)
    assert joint != JOINT
    return with_joint(joint)


def tangents_of(filaments, *places):
    for number, element, fraction in places:
        own = filaments[number]
        slopes = element_slopes(own.positions, own.control_points, [fraction], own.type.segment_length)
        yield slopes[element, 0]


def built_energy(text):
    """The filaments of a configuration, and the energy of its joints as it begins."""
    built = build_system(parse_configuration(text), None, 5)
    found = [force for force in built.system.getForces() if force.getName() == "Joints"]
    for force in found:
        force.setForceGroup(9)
    context = new_context(built.system, built.positions, openmm.VerletIntegrator(1.0))
    return built.filaments, energy_of(context, {9}), len(found)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 90.0, 130.0, 180.0])
def test_energies_are_those_of_the_angle(degrees):
    filaments, energy, forces = built_energy(changed("40 deg", f"{degrees} deg"))
    assert forces == 1
    first, second = tangents_of(filaments, (0, 1, 0.25), (1, 2, 1.0))
    angle = np.radians(degrees)
    if degrees > 90.0:
        second, angle = -second, np.pi - angle
    extension = np.linalg.norm(first - second) - 2.0 * np.sin(0.5 * angle)
    assert energy == pytest.approx(200.0 * (extension / np.cos(0.5 * angle)) ** 2, rel=1e-9)
    # That of nearly any other angle is another one.
    assert energy > 1.0


def test_a_joint_without_an_angle_is_at_rest_where_it_begins():
    # Vectors are not quite of unit length.
    assert built_energy(changed('angle = "40 deg"\n', ""))[1] < 0.2


@pytest.mark.parametrize("place", ["node = 0 }", "segment = 0, fraction = 0 }", 'arc_length = "0 nm" }'])
@pytest.mark.parametrize("turned", [False, True])
def test_directions_may_come_first_or_second(place, turned):
    tables = [f"{{ filament = 2, {place}", "{ direction = [0, 0, 2] }"]
    between = f"[{', '.join(tables[::-1] if turned else tables)}]"
    text = with_joint(f'[[joint]]\nbetween = {between}\nstiffness = "1000 pN*nm"\nangle = "60 deg"\n')
    filaments, energy, _ = built_energy(text)
    (tangent,) = tangents_of(filaments, (2, 0, 0.0))
    extension = np.linalg.norm(tangent - [0.0, 0.0, 1.0]) - 1.0
    assert energy == pytest.approx(0.5 * 602.214076 * extension**2 * 4.0 / 3.0, rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("filament = 1", "filament = 3", r"between\[1\] filament 3 \(ACT\) has straight segments"),
        ("filament = 1", "filament = 9", r"between\[1\] filament 9 does not exist; there are 6"),
        ("node = -1", "node = 4", r"node 4 does not exist in filament 1; there are 4"),
        ("node = -1", "segment = 3", "segment 3 does not exist; there are 3"),
        ("1.25 um", "3.25 um", "is beyond the end of the filament"),
        ("node = -1", "direction = [1, 0, 0]", "filament cannot be with a direction"),
        (
            '{ filament = 0, arc_length = "1.25 um" }, { filament = 1, node = -1 }',
            "{ direction = [1, 0, 0] }, { direction = [0, 1, 0] }",
            "between must have a filament",
        ),
        ("filament = 1, node = -1", "direction = [0, 0, 0]", "must not be the zero vector"),
        ("filament = 1, node = -1", "filament = 1", "lacks a place on the filament"),
        ("filament = 1, node = -1", 'point = ["0 nm", "0 nm", "0 nm"]', "unknown key 'point'"),
        ("400 kJ/mol", "400 pN", "stiffness has the unit 'pN'|which is not one of energy"),
        ("400 kJ/mol", "-400 kJ/mol", "stiffness must be positive"),
        ("40 deg", "181 deg", 'angle must be at most "180 deg"'),
        ("40 deg", "-40 deg", "angle must be zero or positive"),
        ("40 deg", "40 nm", "which is not one of angle"),
        ('"40 deg"', "40", "angle must be a text with a number and a unit"),
        ('stiffness = "400 kJ/mol"\n', "", "lacks the key 'stiffness'"),
        ("angle", "rest_length", r"unknown key 'rest_length'. It belongs to"),
    ],
)
def test_mistakes_are_named_with_their_lines(old, new, message):
    text = changed(old, new)
    with pytest.raises(InputError, match=message) as caught:
        parse_configuration(text)
    # The table ends behind its four lines.
    begin = text[: text.index("[[joint]]")].count("\n") + 1
    line = int(str(caught.value).split(":")[0].removeprefix("line "))
    assert begin <= line < begin + 4


def test_what_has_changed_is_named():
    before, after = parse_configuration(with_joint()), parse_configuration(changed("400", "500"))
    assert changed_keys(before, after) == ["[[joint]] number 1: stiffness"]
    assert changed_keys(before, parse_configuration(PLAIN)) == ["the number of [[joint]] tables"]


def test_runs_have_joints_that_hold(tmp_path, capsys):
    """As stiff as two of the elements, so that the angle stays within a tenth of a radian."""
    joint = JOINT.replace("400 kJ/mol", "1e5 kJ/mol")
    (tmp_path / "dry.toml").write_text(with_joint(joint))
    assert main(["run", str(tmp_path / "dry.toml"), "--dry-run"]) == 0
    assert "1 joint\n" in capsys.readouterr().out
    directory = simulated(tmp_path, with_joint(joint))
    assert "joints hold their directions" in capsys.readouterr().out
    run = analysis.load(directory)
    angles = []
    for frame in range(20, len(run)):
        positions = run.positions(frame)
        slopes = [
            element_slopes(positions[own.nodes], positions[own.control_points], [0.25, 1.0], 1.0)
            for own in run.filaments[:2]
        ]
        first, second = (one / np.linalg.norm(one) for one in (slopes[0][1, 0], slopes[1][2, 1]))
        angles.append(np.degrees(np.arccos(first @ second)))
    assert np.abs(np.array(angles) - 40.0).max() < 3.0
