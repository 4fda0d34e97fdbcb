"""Filaments with twist in files of runs: their types, frames at their ends, `twist.csv`, stages, and resuming."""

import gsd.hoomd
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from openmm_cylchain import DSDNA, analysis
from openmm_cylchain.cli import main
from openmm_cylchain.rendering.scene import Look, make_scene
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.created_simulation import create_simulation
from openmm_cylchain.runs.keys import ConfigurationError
from openmm_cylchain.units.quantities import thermal_energy
from support.small_runs import run_command, simulated, stop_and_resume
from support.twisted_run import WOUND


@pytest.fixture(scope="module")
def wound(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wound")
    return simulated(folder, WOUND)


def test_twist_and_torque_at_each_report(wound):
    run = analysis.load(wound)
    turns, torque = run.twist["twist (turns)"], run.twist["torque (pN nm)"]
    assert turns.shape == torque.shape == (41, 2)
    np.testing.assert_array_equal(run.twist["filament"], [[0, 1]] * 41)
    # Half a turn in the first stage, which the second one keeps, but for the writhe.
    np.testing.assert_allclose(turns[[0, 20]], [[0.0] * 2, [0.5] * 2], atol=0.05)
    assert np.abs(turns[20:] - 0.5).max() < 0.06
    # Of a chain whose twist is even; the joints at its ends differ from that, thermally.
    rigidity = 100.0 * thermal_energy(298) / 0.602214
    assert torque[10:].mean() == pytest.approx(2 * np.pi * rigidity * turns[10:].mean() / 100.0, rel=0.1)


def test_twists_of_all_joints_and_frames_of_segments(wound):
    run = analysis.load(wound)
    for frame in (0, 17, -1):
        twists, vectors = run.twists(frame), run.material_frames(frame)
        turns = [own.sum() / (2 * np.pi) for own in twists]
        np.testing.assert_allclose(turns, run.twist["twist (turns)"][frame], rtol=1e-10, atol=1e-12)
        for own, across, nodes in zip(twists, vectors, run.nodes(frame)):
            tangents = np.diff(nodes, axis=0)
            tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
            assert own.shape == (21,) and across.shape == (20, 3)
            np.testing.assert_allclose(np.einsum("ij,ij->i", across, tangents), 0.0, atol=1e-12)
            np.testing.assert_allclose(np.linalg.norm(across, axis=1), 1.0)
            # Turned back by its twist, each vector is carried to the one before by the rotation about their binormal.
            for s in range(1, 20):
                turn = Rotation.from_rotvec(-own[s] * tangents[s])
                axis = np.cross(tangents[s], tangents[s - 1])
                size = np.linalg.norm(axis)
                back = Rotation.from_rotvec(np.arctan2(size, tangents[s] @ tangents[s - 1]) * axis / max(size, 1e-30))
                np.testing.assert_allclose(back.apply(turn.apply(across[s])), across[s - 1], atol=1e-9)


def test_exports_and_pictures_show_frames(wound, tmp_path):
    assert main(["export", str(wound), "--format", "ovito", "--output", str(tmp_path / "run.gsd")]) == 0
    run = analysis.load(wound)
    with gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
        orientation = file[-1].particles.orientation
    turns = Rotation.from_quat(orientation[:, [1, 2, 3, 0]])
    for number, (across, nodes) in enumerate(zip(run.material_frames(-1), run.nodes(-1))):
        own = turns[21 * number : 21 * (number + 1)]
        along = np.diff(nodes, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        np.testing.assert_allclose(own.apply([1, 0, 0])[:20], across, atol=1e-6)
        np.testing.assert_allclose(own.apply([0, 0, 1]), np.vstack([along, along[-1:]]), atol=1e-6)
    tubes = make_scene(run, Look(), [0]).tubes(-1)
    stripes = np.flatnonzero((tubes.colors < 0.2).all(axis=1))
    assert len(stripes) == 2 * 2 * 20 and len(tubes.colors) == 3 * 2 * 20
    radii = tubes.radii[stripes] / 0.6
    middles = run.nodes(-1)[0][:-1] + 0.5 * np.diff(run.nodes(-1)[0], axis=0)
    out = tubes.ends[stripes[:20], 1] - middles
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 0.7 * radii[0], rtol=1e-6)
    # Half a turn from one end to the other.
    assert run.material_frames(-1)[0][0] @ run.material_frames(-1)[0][-1] < -0.5


def test_intrinsic_twist(wound, tmp_path):
    """It is among the turns, and the torque is that without it."""
    text = WOUND.replace('"100 nm"', '"100 nm"\nintrinsic_twist = "-34.3 deg/angstrom"')
    simulated(tmp_path, text)
    for own, expected in zip(
        analysis.load(tmp_path / "out").material_frames(3), analysis.load(wound).material_frames(3)
    ):
        np.testing.assert_allclose(own, expected, atol=1e-3)
    run, plain = analysis.load(tmp_path / "out").twist, analysis.load(wound).twist
    difference = run["twist (turns)"] - plain["twist (turns)"]
    np.testing.assert_allclose(difference, np.full((41, 2), -343 / 360 * 19 * 5), rtol=1e-6)
    np.testing.assert_allclose(run["torque (pN nm)"][:5], plain["torque (pN nm)"][:5], rtol=1e-4, atol=1e-4)


def test_a_resumed_run_is_the_same(wound, tmp_path, monkeypatch):
    stop_and_resume(run_command(tmp_path, WOUND), monkeypatch, checkpoints=3)
    for name in ("twist.csv", "twists.npy", "energies.csv", "trajectory.dcd"):
        assert (tmp_path / "out" / name).read_bytes() == (wound / name).read_bytes()


POLYMERASE = """
[[linkers]]
name = "polymerase"
count = 2
volume = "1 um^3"
stiffness = "1 pN/nm"
bound_at = [{ filament = [0, 1], arc_length = "40 nm" }]
[[linkers.hands]]
binding_rate = "0 1/s"
reach = "10 nm"
unbinding_rate = "0 1/s"
speed = "5 um/ms"
helix = { pitch = "3.57 nm", rotational_friction = "1 pN*nm*s", stall_torque = "11 pN*nm" }
[[linkers.hands]]
binding_rate = "0 1/s"
reach = "10 nm"
unbinding_rate = "0 1/s"
[[stage]]
"""


def test_hands_that_follow_the_helix(tmp_path, monkeypatch):
    text = WOUND.replace("[[stage]]", POLYMERASE, 1)
    kind = parse_configuration(text).linkers[0].kind
    assert kind.hands[0].helix.stall_torque == pytest.approx(11.0 * 0.602214, rel=1e-5)
    assert kind.hands[0].helix.torque_range == 100.0 and kind.hands[1].helix is None
    (tmp_path / "whole").mkdir()
    assert main(run_command(tmp_path / "whole", text)) == 0
    stop_and_resume(run_command(tmp_path, text), monkeypatch, checkpoints=3)
    for name in ("twist.csv", "twists.npy", "linkers.csv", "trajectory.dcd"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "whole" / "out" / name).read_bytes()
    with pytest.raises(ConfigurationError, match="pitch"):
        parse_configuration(text.replace('"3.57 nm"', '"0 nm"'))
    with pytest.raises(ConfigurationError, match="no twist"):
        own = text.replace('[[end_frame]]\ntable = 1\nend = "minus"\ndirection = [0, 0, 1]\n', "")
        own = own[: own.index("[[end_frame]]")] + own[own.index("[[pull]]") : own.index("[stage.end_frame")]
        create_simulation(parse_configuration(own.replace('twist_persistence_length = "100 nm"\n', "")))


def test_a_torsional_rigidity_in_place_of_a_length():
    def kind(*lines):
        own = WOUND.replace('twist_persistence_length = "100 nm"', "\n".join(lines))
        return parse_configuration(own).filaments[0].type

    rigidity = 100.0 * thermal_energy(298)
    of_length = kind('twist_persistence_length = "100 nm"')
    assert of_length.torsional_rigidity == pytest.approx(rigidity)
    assert of_length.bending_rigidity == DSDNA.bending_rigidity
    assert kind('torsional_rigidity = "411 pN nm^2"').torsional_rigidity == pytest.approx(411 * 0.602214, rel=1e-5)
    both = kind('twist_persistence_length = "100 nm"', 'persistence_length = "50 nm"')
    assert both.torsional_rigidity == pytest.approx(rigidity)
    assert both.bending_rigidity == pytest.approx(0.5 * rigidity)
    elsewhere = kind('twist_persistence_length = "100 nm"', 'temperature = "149 K"')
    assert elsewhere.torsional_rigidity == pytest.approx(0.5 * rigidity)
    beside = kind('twist_persistence_length = "100 nm"', 'bending_rigidity = "205 pN nm^2"')
    assert (beside.temperature, beside.torsional_rigidity) == (None, pytest.approx(rigidity))


def test_bead_turns_against_its_friction(tmp_path):
    """By a torque, as far as its chain lets it, whose twist is even."""
    text = WOUND[: WOUND.index("[[stage]]")].replace(
        'angular_velocity = "3.141592653589793 1/us"', 'torque = "60 pN nm"\nrotational_friction = "13 pN nm us"'
    )
    text = text.replace("[simulation]", '[simulation]\nduration = "4 us"')
    assert main(run_command(tmp_path, text)) == 0
    turns = analysis.load(tmp_path / "out").twist["twist (turns)"].mean(axis=1)
    rigidity = 100.0 * thermal_energy(298) / 0.602214
    end, relaxation = 60.0 * 100.0 / rigidity / (2 * np.pi), 13.0 * 100.0 / rigidity
    time = 0.05 * np.arange(len(turns))
    np.testing.assert_allclose(turns, end * (1.0 - np.exp(-time / relaxation)), atol=0.2 * end)


BEAD = """
[[body]]
radius = "5 nm"
positions = [["0 nm", "0 nm", "60 nm"]]
direction = [1, 0, 0]
points = [["0 nm", "0 nm", "-10 nm"], ["0 nm", "0 nm", "-15 nm"]]
[[link]]
between = [{ filament = 0, node = -1 }, { body = 0, body_point = 1 }]
stiffness = "100 pN/nm"
[[link]]
between = [{ filament = 0, node = -2 }, { body = 0, body_point = 2 }]
stiffness = "100 pN/nm"
[[pull]]
"""


def test_bead_that_carries_a_frame_gives_way(tmp_path):
    """A small one turns with the frame at the other end, which would keep half a turn between two that are held."""
    text = WOUND.replace("count = 2", "count = 1").replace("[[pull]]\n", BEAD.lstrip(), 1)
    text = text.replace('end = "plus"\n', 'end = "minus"\n').replace('end = "minus"', 'end = "plus"\nbody = 0', 1)
    assert main(run_command(tmp_path, text)) == 0
    turns = analysis.load(tmp_path / "out").twist["twist (turns)"]
    assert np.abs(turns).max() > 0.1 and np.abs(turns[20:]).max() < 0.45


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('twist_persistence_length = "100 nm"\n', "", "number 1.*filament 0 has no twist: give its type"),
        ('"100 nm"', '"100 nm"\ntorsional_rigidity = "411 pN nm^2"', "give either torsional_rigidity or"),
        ('"100 nm"', '"-100 nm"', "twist_persistence_length"),
        ('"100 nm"', '"100 nm"\nintrinsic_twist = "1.8 nm"', "angle per length"),
        ('twist_persistence_length = "100 nm"', 'intrinsic_twist = "1.8 rad/nm"', "intrinsic_twist needs a torsional"),
        ('"100 nm"', '"100 nm"\nelement = "beam"', "twist"),
        ('end = "plus"', 'end = "right"', "end"),
        ('end = "plus"', 'end = "minus"', "has a frame already"),
        ('"3.141592653589793 1/us"', '"1 1/us"\ntorque = "8 pN nm"', "that is held"),
        ('"3.141592653589793 1/us"', '"1 1/us"\nrotational_friction = "3 pN nm us"', "that is held"),
        ('angular_velocity = "3.141592653589793 1/us"', 'rotational_friction = "0 pN nm us"', "rotational_friction"),
        ('angular_velocity = "3.141592653589793 1/us"', "body = 0", "body 0 does not exist; there are 0"),
        ("direction = [0, 0, 1]\nangular", "direction = [0, 0, 0]\nangular", "direction"),
        ("seed = 3", 'seed = 3\nengine = "portable"', r"no \[\[end_frame\]\]|has no"),
        ('angular_velocity = "0 1/us"', "active = false", "active"),
    ],
)
def test_what_is_refused(old, new, message):
    assert old in WOUND
    with pytest.raises(ConfigurationError, match=message):
        configuration = parse_configuration(WOUND.replace(old, new))
        create_simulation(configuration)
