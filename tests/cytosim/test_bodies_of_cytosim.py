"""Beads, solids, spheres and asters of Cytosim as bodies, and what is on them."""

import math

import numpy as np
import pytest

from openmm_cylchain import InputError
from openmm_cylchain.couplings.capsule_contacts import as_capsule_contact_force
from openmm_cylchain.cytosim.command import import_file
from openmm_cylchain.cytosim.translation import translate
from openmm_cylchain.runs.configuration import read_configuration
from openmm_cylchain.runs.initial_state import build_system

HEAD = """
set simul system { time_step = 0.001; viscosity = 0.1; kT = 0.0042; dim = 3 }
set space cell { shape = sphere }
new cell { radius = 8 }
set fiber tube { rigidity = 20; segmentation = 0.5; confine = inside, 100 }
set hand dynein { binding = 10, 0.05; unbinding = 1, 3; activity = move; unloaded_speed = -1; stall_force = 5 }
set hand glue { binding = 10, 0.05; unbinding = 0 }
set single motor { hand = dynein; stiffness = 100 }
set single staple { hand = glue; stiffness = 200 }
set solid core { confine = inside, 100 }
set aster star { stiffness = 1000, 500 }
"""
RUN = "run 1000 system { nb_frames = 10 }\n"
PN_PER_UM = 0.602214076e-3


def translated(tmp_path, text, head=HEAD):
    path, output = tmp_path / "my.cym", tmp_path / "my.toml"
    path.write_text(head + text + RUN)
    output.unlink(missing_ok=True)
    import_file(path, output)
    document = translate(path, "my").document
    assert output.read_text() == document.text()
    return read_configuration(output), document


def built_of(configuration):
    return build_system(configuration, None, 1).filaments


def test_asters_hold_fibers_by_two_springs(tmp_path):
    """Between the inner radius and the outer one, where src/sim/organizers/aster.cc has its points."""
    text = "new 2 star { solid = core; radius = 0.6, 0.2; point1 = center, 0.6; fibers = 12, tube, ( length = 3; ) }\n"
    found, document = translated(tmp_path, text)
    assert document.missing == []
    (body,) = found.bodies
    held = body.held
    assert (body.count, held.arm) == (2, pytest.approx(400.0))
    assert (held.stiffness, held.arm_stiffness) == (pytest.approx(1000 * PN_PER_UM), pytest.approx(500 * PN_PER_UM))
    filaments = built_of(found)
    assert len(filaments) == 24
    for number, filament in enumerate(filaments):
        nodes = filament.positions - filaments.bodies[number % 2].positions[0]
        np.testing.assert_allclose(np.linalg.norm(nodes, axis=1), 200.0 + 500.0 * np.arange(7), rtol=1e-6)


@pytest.mark.parametrize(
    ("keys", "arm"),
    [
        ("type = disc; radius = 0.5, 0.4", 200.0),
        ("type = angular; aster_angle = 0.5; radius = 0.5, 0.1", 400.0),
        ("type = astral; radius = 0.5, 0.3", 300.0),
        ("radius = 0.5; fiber1 = 0 0 0, 1 0 0; fiber2 = 0 1 0, 0 1 1; fiber3 = 0 -1 0, 0 -2 0", 500.0),
    ],
)
def test_asters_that_are_not_radial(tmp_path, keys, arm):
    """See src/sim/organizers/aster.cc: a cap about x, a disc across x, any place of a ball, or given ones."""
    text = f"new star {{ solid = core; {keys}; fibers = 3, tube, ( length = 3; ) }}\n"
    found, document = translated(tmp_path, text)
    assert document.missing == []
    held = found.bodies[0].held
    assert held.arm == pytest.approx(arm)
    places, directions = held.places, held.directions
    if "disc" in keys:
        np.testing.assert_allclose(directions, [[1, 0, 0]] * 3)
        np.testing.assert_allclose(places[:, 0], -100.0)
        assert np.linalg.norm(places[:, 1:], axis=1).max() < 500.0
    elif "angular" in keys:
        np.testing.assert_allclose(places, 100.0 * directions, atol=1e-5)
        assert np.all(directions[:, 0] > np.cos(0.5)) and np.any(directions[:, 0] < np.cos(0.1))
    elif "astral" in keys:
        outside = places + 300.0 * directions
        assert np.all(np.linalg.norm(outside, axis=1) < 500.0) and np.all(np.sum(outside * directions, axis=1) > 0.0)
    else:
        np.testing.assert_allclose(places, [[0, 0, 0], [0, 500, 0], [0, -500, 0]], atol=1e-9)
        np.testing.assert_allclose(directions, [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-9)
    filaments = built_of(found)
    placed = filaments.bodies[0]
    for place, vector, filament in zip(places, directions, filaments):
        np.testing.assert_allclose(filament.positions[0], placed.positions[0] + placed.rotation @ place, atol=1e-6)
        step = filament.positions[1] - filament.positions[0]
        np.testing.assert_allclose(step, 500.0 * placed.rotation @ vector, atol=1e-6)


@pytest.mark.parametrize(
    ("keys", "end", "missing"),
    [
        ("activity = grow; growing_speed = 0.1;", "plus_end = grow;", []),
        (
            "activity = grow; growing_speed = 0.1, 0.1;",
            "plus_end = grow; minus_end = grow;",
            ["fibers that grow where"],
        ),
    ],
)
def test_fibers_that_grow_are_held_where_their_ends_stay(tmp_path, keys, end, missing):
    head = HEAD.replace("rigidity = 20;", f"rigidity = 20; {keys}")
    text = f"new star {{ solid = core; radius = 0.5; fibers = 6, tube, ( length = 2; {end} ) }}\n"
    found, document = translated(tmp_path, text, head)
    assert [own[:22] for own in document.missing] == missing
    assert (found.bodies[0].held is None) == bool(missing)
    if not missing:
        assert len(built_of(found).linkers) == 2


def test_fibers_that_shrink_keep_the_springs_that_hold_them(tmp_path):
    """Where Cytosim brings the second one nearer, they shrink to where it is at most."""
    keys = "activity = classic; growing_speed = 0.1; shrinking_speed = -0.5; catastrophe_rate = 0.1; persistent = 1;"
    head = HEAD.replace("rigidity = 20;", f"rigidity = 20; min_length = 0.05; {keys}")
    text = "new star { solid = core; radius = 0.5, 0.1; fibers = 6, tube, ( length = 2; plus_end = grow ) }\n"
    found, document = translated(tmp_path, text, head)
    assert found.bodies[0].held.arm == pytest.approx(400.0)
    assert 400.0 <= found.filaments[0].growth.shortest < 410.0
    (table,) = document.tables_called("[filament.growth]")
    (note,) = [note for key, _, note in table.entries if key == "shortest"]
    assert str(note).startswith("nearest") and len(built_of(found).linkers) == 2


def test_ends_of_fibers_that_touch_each_other_are_apart(tmp_path):
    head = HEAD.replace("set simul system {", "set simul system { steric = 1, 100;").replace(
        "rigidity = 20;", "rigidity = 20; steric = 1, 0.05;"
    )
    text = "new star { solid = core; radius = 0.6; fibers = 40, tube, ( length = 2; ) }\n"
    filaments = built_of(translated(tmp_path, text, head)[0])
    ends = np.array([own.positions[0] for own in filaments])
    distances = np.linalg.norm(ends[:, None] - ends, axis=2) + 1e9 * np.eye(40)
    # Twice the radius of steric, and not far more.
    assert 100.0 < distances.min() < 120.0


def test_bodies_push_each_other_where_steric_is_on(tmp_path):
    """With the stiffness of steric, at the sum of their radii, and beside fibers that nothing touches."""
    head = HEAD.replace("set simul system {", "set simul system { steric = 1, 100;")
    beads = "set bead ball { steric = 1 }\nset bead ghost { steric = 0 }\nnew 3 ball { radius = 1 }\n"
    beads += "new 2 ghost { radius = 0.5 }\n"
    found, document = translated(tmp_path, beads, head.replace("set fiber tube {", "set bead tube {"))
    assert document.missing == []
    assert found.contacts.stiffness == pytest.approx(100 * PN_PER_UM)
    assert [own.contacts for own in found.bodies] == [True, False]
    built = build_system(found, None, 1)
    assert "CylinderChainContactForce" in [force.getName() for force in built.system.getForces()]
    found, document = translated(tmp_path, beads + "new 2 tube { length = 1 }\n", head)
    assert document.missing == [] and found.filaments[0].contact_diameter is None
    built = build_system(found, None, 1)
    (force,) = filter(None, map(as_capsule_contact_force, built.system.getForces()))
    assert (force.getNumChains(), force.getNumSpheres()) == (0, 3)
    touching = head.replace("rigidity = 20;", "rigidity = 20; steric = 1, 0.05;").replace(
        "confine = inside, 100 }\nset aster", "steric = 1 }\nset aster"
    )
    text = "new star { solid = core; radius = 0.6; fibers = 4, tube, ( length = 2; ) }\n"
    found, document = translated(tmp_path, text, touching)
    assert not found.bodies[0].contacts and document.missing == ["contacts of bodies that hold fibers"]
    found, document = translated(tmp_path, text, touching.replace("; steric = 1, 0.05", ""))
    assert found.bodies[0].contacts and document.missing == []


def test_solids_have_points_radii_and_singles(tmp_path):
    text = """new core {
        point1 = 0 0 -1, 0.5
        point2 = 3, sphere 0.7, 0, 2 motor each
        sphere3 = 0 0 1, 0.4, 7 motor, 5 motor equator 1
        single1 = 2 motor, point1, point3, 0.25
        position = 1 2 0
        direction = 0 1 0
    }
    new 2 tube { length = 2 }
    """
    found, document = translated(tmp_path, text)
    assert document.missing == []
    (body,) = found.bodies
    points, radii = body.body.points / 1e3, body.body.radii / 1e3
    assert sorted(radii[radii > 0.0]) == [0.4, 0.5] and len(points) == 1 + 3 + 1 + 12 + 1
    np.testing.assert_allclose(np.linalg.norm(points[1:4], axis=1), 0.7, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(points[5:17] - [0, 0, 1], axis=1), 0.4, rtol=1e-6)
    np.testing.assert_allclose(points[12:17, 2], 1.0, atol=1e-9)
    np.testing.assert_allclose(points[17], [0, 0, -0.5], atol=1e-9)
    (group,) = found.linkers
    assert group.body_anchors == (1, (1, 1, 2, 2, 3, 3, *range(5, 17), 17, 17))
    # src/sim/solid.cc: 6 pi viscosity times the sum of radii; a viscosity of 0.1 Pa s.
    drag = 6.0 * math.pi * 0.1 * (0.5 + 0.4) * 1e-6
    assert body.body.friction(found.solvent.viscosity) == pytest.approx(drag * 6.02214076e14, rel=1e-6)
    positions = built_of(found).bodies[0].positions
    # x of the frame points along y.
    np.testing.assert_allclose(
        positions[1] - [1e3, 2e3, 0.0], 1e3 * np.array([-points[1][1], points[1][0], points[1][2]])
    )


@pytest.mark.parametrize(("given", "drag"), [("20", 20.0), ("inf", 1e8)])
def test_bodies_have_viscosities_of_their_own(tmp_path, given, drag):
    text = f"set bead ball {{ viscosity = {given} }}\nset bead other {{ }}\nnew ball {{ radius = 0.2 }}\n"
    found, document = translated(tmp_path, text + "new other { radius = 0.2 }\n")
    frictions = [own.body.friction(found.solvent.viscosity) for own in found.bodies]
    # 6 pi viscosity radius, in Pa s and m.
    assert frictions[1] == pytest.approx(6 * np.pi * 0.1 * 0.2e-6 * 6.02214076e14, rel=1e-6)
    assert frictions[0] / frictions[1] == pytest.approx(drag / 0.1)
    assert document.missing == []


def test_beads_and_spheres(tmp_path):
    text = """set bead grain { confine = all_inside, 100 }
    new 10 grain { radius = 0.25; attach = 3 motor }
    set sphere vesicle { confine = inside, 100; point_mobility = 1 }
    new vesicle { radius = 1; point1 = 6, surface; attach = 1 motor each; position = -3 0 0 }
    new 2 tube { length = 2 }
    """
    found, document = translated(tmp_path, text)
    assert document.missing == []
    grain, vesicle = found.bodies
    assert (grain.count, grain.body.radii[0], vesicle.count, vesicle.body.radii[0]) == (10, 250.0, 1, 1000.0)
    np.testing.assert_allclose(np.linalg.norm(vesicle.body.points[1:7], axis=1), 1000.0, rtol=1e-6)
    assert [own.body_anchors for own in found.linkers] == [(1, (0, 0, 0)), (2, (1, 2, 3, 4, 5, 6))]
    assert any("slide on its surface" in note.text for note in document.notes)
    depths = [np.linalg.norm(own.positions[0]) + own.body.radii[0] for own in built_of(found).bodies]
    assert max(depths) < 8000.0 + 250.0


def test_singles_have_bases_on_bodies(tmp_path):
    """Objects are counted from the first one as name1, and from the last one as name~1."""
    text = """
    new core { point1 = 0 0 0, 0.3; point2 = 0 0 1, 0; position = 1 0 0 }
    new core { point1 = 0 0 0, 0.4; point2 = 0 0 1, 0; position = 3 0 0 }
    new tube { length = 2 }
    new tube { length = 2 }
    new 4 motor { base = core1, point2 }
    new staple { base = solid2, point2; attach = tube1, 0.5 }
    new staple { base = core~2, point1; attach = tube~1, 0 }
    new motor { base = core3, point1 }
    """
    found, document = translated(tmp_path, text)
    assert document.missing == ["bodies: singles on one of several"]
    (group,) = found.linkers
    assert group.body_anchors == (1, (1, 1, 1, 1))
    first, second = (
        {(key, own[key]) for own in link.between for key in ("filament", "body", "body_point")} for link in found.links
    )
    assert {("filament", 0), ("body", 1), ("body_point", 1)} <= first
    assert {("filament", 1), ("body", 0), ("body_point", 0)} <= second


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("new core { point1 = center, 0 }\nnew tube { length = 1 }\n", "bodies: solids without a radius"),
        ("new core { point1 = center, 1; position = somewhere 1 }\nnew tube { length = 1 }\n", "positions: somewhere"),
        ("new core { point1 = center, 1, nothing }\nnew tube { length = 1 }\n", "bodies: what is attached to them"),
        (
            "new star { solid = core9; radius = 0.5; fibers = 3, tube }\nnew tube { length = 1 }\n",
            "bodies: asters on a",
        ),
    ],
)
def test_what_bodies_cannot_do_here_is_said(tmp_path, text, missing):
    _, document = translated(tmp_path, text)
    assert any(own.startswith(missing) for own in document.missing), document.missing


@pytest.mark.parametrize(
    "place",
    [
        "sphere1 = 0 0 0, 1, 12 {}",
        "point1 = 0 0 0, 1, {} each",
        "point1 = 0 0 0, 1; single1 = {}, point1",
        "ball1 = 0 0 0, 1, {}",
    ],
)
@pytest.mark.parametrize("name", ["protein", "tube", "dynein"])
def test_what_is_no_single_is_left_out_in_words(tmp_path, place, name):
    found, document = translated(tmp_path, f"new 1 core {{ {place.format(name)} }}\n")
    assert len(found.bodies) == 1 and not found.linkers
    assert any("what is attached to them" in str(own) for own in document.missing)


def test_asters_of_too_many_fibers_are_refused_at_once(tmp_path):
    text = "new star { solid = core; radius = 0.6, 0.2; fibers = 1000000000, tube, ( length = 1; ) }\n"
    with pytest.raises(InputError, match="1000000000 tube are more than 1000000"):
        translated(tmp_path, text)
