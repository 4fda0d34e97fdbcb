"""Tables of configurations beyond filaments and linkers: what is built is what Python builds, and what is refused."""

import functools
import itertools
import re
import sys

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    Box,
    Capsule,
    Crosslinks,
    Cylinder,
    Ellipsoid,
    Filaments,
    Flow,
    InputError,
    Plane,
    Slab,
    Sphere,
    Torus,
    capsule_contact_force,
    constant_force,
    constant_tension,
    filament_wall_force,
    prism_faces,
    stokes_friction,
    theory,
    wall_force,
)
from openmm_cylchain.couplings.walls import as_filament_wall_force
from openmm_cylchain.output.progress import LateMessages
from openmm_cylchain.runs.configuration import changed_keys, parse_configuration, read_configuration
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.relaxation import relaxed_positions
from openmm_cylchain.runs.run import create_simulation, run
from openmm_cylchain.runs.run_directory import RunDirectory
from openmm_cylchain.runs.summary import load_trajectory, summarise
from openmm_cylchain.runs.toml_lines import lines_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

PN = 0.602214076
ETA = 1e-2 * unit.pascal * unit.second
HEAD = '[solvent]\ntemperature = "310 K"\nviscosity = "10 mPa*s"\n'
FILAMENT = '[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nsegments = 6\n'
TAIL = '[simulation]\ntime_step = "1 us"\nduration = "100 us"\nreport_interval = "10 us"\nseed = 3\n'
BOX = '[box]\nedges = ["2 um", "2 um", "2 um"]\n'
WALL = '[[wall]]\nshape = "sphere"\nradius = "2 um"\nstiffness = "0.1 pN/nm"\n'
LINK = '[[link]]\nbetween = [{ filament = 0, arc_length = "150 nm" }, { filament = 1, node = -1 }]\n'
LINK += 'stiffness = "0.1 pN/nm"\n'
TETHER = '[[tether]]\nfilament = 0\nnode = -1\nstiffness = "0.1 pN/nm"\n'
PULL = '[[pull]]\nfilament = 1\ntension = "2 pN"\n'
MONOMERS = '[[monomers]]\ntype = "ACTIN_ATP"\nconcentration = "5 uM"\n'
GROWTH = 'growth = { longest = "1 um" }\n'
CONTACTS = '[contacts]\ndiameter = "15 nm"\n'
PARTICLES = '[[particles]]\ndiameter = "50 nm"\npositions = [["0 nm", "0 nm", "1 um"], ["0 nm", "1 um", "0 nm"]]\n'
ACTIN = F_ACTIN.with_segment_length(100.0)


def parse(*tables, filament=FILAMENT + "count = 3\n", simulation=TAIL, folder="."):
    return parse_configuration(HEAD + filament + "".join(tables) + simulation, folder)


def built(*tables, engine=None, **parts):
    return build_system(parse(*tables, **parts), engine, 3)


def by_hand(positions, engine=None, **options):
    filaments = Filaments(ETA, 310.0, engine)
    for nodes in positions:
        filaments.add_nodes(ACTIN, nodes, **options)
    return filaments


def assert_same_system(one, system):
    texts = [openmm.XmlSerializer.serialize(own) for own in (one.system, system)]
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("keys", "shape"),
    [
        ('shape = "plane"\npoint = ["1 nm", "2 nm", "3 nm"]\nnormal = [0, 1, 1]', Plane([1, 2, 3], [0, 1, 1])),
        ('shape = "slit"\nthickness = "1 um"', Slab([0, 0, 0], [0, 0, 1], 1000)),
        ('shape = "sphere"\ncenter = ["0 nm", "5 nm", "0 nm"]\nradius = "2 um"', Sphere([0, 5, 0], 2000)),
        ('shape = "cylinder"\naxis = [0, 0, 2]\nradius = "2 um"', Cylinder([0, 0, 0], [0, 0, 2], 2000)),
        ('shape = "box"\nlower = ["-1 um", "-1 um", "-1 um"]\nupper = ["1 um", "1 um", "2 um"]', None),
        ('shape = "capsule"\nlength = "4 um"\nradius = "2 um"', Capsule([0, 0, 0], [1, 0, 0], 4000, 2000)),
        (
            'shape = "torus"\nmajor_radius = "4 um"\nminor_radius = "2 um"\naxis = [0, 0, 1]',
            Torus([0, 0, 0], [0, 0, 1], 4000, 2000),
        ),
        ('shape = "ellipsoid"\nsemi_axes = ["1 um", "2 um", "3 um"]', Ellipsoid([0, 0, 0], [1000, 2000, 3000])),
    ],
)
def test_walls_are_those_of_python(keys, shape):
    shape = shape or Box([-1000] * 3, [1000, 1000, 2000])
    text = f'[[wall]]\n{keys}\nstiffness = "0.1 pN/nm"\ndistance = "3.5 nm"\n'
    own = built(text)
    filaments = by_hand([filament.positions for filament in own.filaments])
    _, system, _ = filaments.build()
    system.addForce(filament_wall_force(filaments, system, shape, 0.1 * PN, 3.5))
    assert_same_system(own, system)


PRISM = 'shape = "prism"\ncorners = [["0 um", "0 um"], ["2 um", "0 um"], ["0 um", "2 um"]]\n'


def test_a_prism_is_its_faces():
    own = built(f'[[wall]]\n{PRISM}bottom = "-1 um"\ntop = "1 um"\nstiffness = "0.1 pN/nm"\ndistance = "3.5 nm"\n')
    filaments = by_hand([filament.positions for filament in own.filaments])
    _, system, _ = filaments.build()
    for face in prism_faces([[0, 0], [2000, 0], [0, 2000]], -1000, 1000):
        system.addForce(filament_wall_force(filaments, system, face, 0.1 * PN, 3.5))
    assert_same_system(own, system)
    stiff = 'stiffness = "1 pN/nm"\n'
    assert_refused("belongs to a prism", f'[[wall]]\nshape = "sphere"\nradius = "2 um"\ntop = "1 um"\n{stiff}')
    assert_refused("is none of a prism", f'[[wall]]\n{PRISM}radius = "2 um"\n{stiff}')
    assert_refused("both a bottom and a top", f'[[wall]]\n{PRISM}top = "2 um"\n{stiff}')
    assert_refused('must be "inside" of a prism', f'[[wall]]\n{PRISM}side = "outside"\n{stiff}')
    flat = PRISM.replace('["0 um", "2 um"]', '["0 um", "2 um", "1 um"]')
    assert_refused("must be x and y", f"[[wall]]\n{flat}{stiff}")


def assert_refused(message, *tables, **parts):
    with pytest.raises(InputError) as caught:
        parse(*tables, **parts)
    assert message in str(caught.value).replace("\n", " ") or re.search(message, str(caught.value)), caught.value


def test_everything_together_is_that_of_python():
    random = '[[link]]\nwithin = "300 nm"\ncount = 5\nstiffness = "0.2 pN/nm"\nrest_length = "90 nm"\n'
    point = 'rest_length = "7 nm"\nmodel = "fene"\nmaximum_extension = "90 um"\nstiffness = "1 pN/nm"\n'
    point = '[[link]]\nbetween = [{ point = ["0 nm", "0 nm", "0 nm"] }, { filament = 2, segment = 1 }]\n' + point
    force = '[[pull]]\ntable = 1\nnode = 2\nforce = ["1 pN", "0 pN", "-1 pN"]\n'
    tether = TETHER.replace('stiffness = "0.1', 'point = ["1 nm", "2 nm", "3 nm"]\nstiffness = "0.1')
    contacts = CONTACTS + 'stiffness = "1 pN/nm"\nexcluded_neighbors = 1\n'
    own = built(
        WALL,
        LINK,
        random,
        point,
        tether,
        PULL,
        force,
        contacts,
        PARTICLES,
        filament=FILAMENT.replace("6", "[6, 6, 7]")
        + 'count = 3\ndirection = [1, 0, 0]\ninside = { shape = "sphere", radius = "0.5 um" }\n',
    )
    shapes = [filament.positions for filament in own.filaments]
    assert [len(nodes) for nodes in shapes] == [7, 7, 8]
    filaments = by_hand(shapes)
    filaments.add_tether(0, -1, [1, 2, 3], 0.1 * PN)
    topology, system, positions = filaments.build()
    for _ in range(2):
        system.addParticle(1.0)
    links = Crosslinks(0.1 * PN, 0.0)
    place = filaments.segment_place(0, arc_length=150)
    start = 0.5 * (shapes[0][1] + shapes[0][2])
    links.add(None, place, 13, rest_length=np.linalg.norm(shapes[1][-1] - start))
    random_links = Crosslinks.from_system(own.system)[0].table(None)
    assert own.links == len(random_links) + 1
    # Which are chosen is random, but all are within the distance and of different filaments.
    owner = np.repeat([0, 1, 2], [7, 7, 8])
    places = random_links.places
    for row in range(1, len(random_links)):
        first, second = (places.positions(np.concatenate(shapes), side)[row] for side in (0, 1))
        assert np.linalg.norm(first - second) <= 300.0
        assert owner[places.pairs[row, 0]] != owner[places.pairs[row, 1]]
    assert len(random_links) == 6
    np.testing.assert_allclose(random_links.rest_length, [np.linalg.norm(shapes[1][-1] - start), *[90.0] * 5])
    np.testing.assert_allclose(random_links.stiffness, [0.1 * PN, *[0.2 * PN] * 5])
    other = Crosslinks.from_system(own.system)[1].table(None)
    np.testing.assert_allclose((other.maximum_extension[0], other.rest_length[0]), (90000.0, 7.0))
    forces = [
        capsule_contact_force(filaments, system, 15, PN, [22, 23], 50.0, 1, periodic=False),
        filament_wall_force(filaments, system, Sphere([0, 0, 0], 2000), 0.1 * PN, 0.0, [22, 23], 25.0),
        constant_tension(filaments, 2 * PN, [1, 0, 0], [1]),
        constant_force([2, 9, 16], np.array([1, 0, -1]) * PN),
    ]
    mine = {force.getName(): force for force in own.system.getForces()}
    for force in forces[:2]:
        serialized = [openmm.XmlSerializer.serialize(one) for one in (force, mine[force.getName()])]
        assert serialized[0] == serialized[1]
    pulls = [force for force in own.system.getForces() if force.getName() == "ConstantForce"]
    for one, force in zip(pulls, forces[2:]):
        assert openmm.XmlSerializer.serialize(one) == openmm.XmlSerializer.serialize(force)
    np.testing.assert_allclose(own.particle_friction, [stokes_friction(50.0, ETA)] * 2)
    assert filaments.tethers == own.filaments.tethers
    assert own.positions._value[22].tolist() == [0, 0, 1000]


def test_flow_is_that_of_python():
    text = '[flow]\nvelocity = ["1 um/s", "0 um/s", "0 um/s"]\nshear = "10 1/s"\nextension = "-2 1/s"\n'
    text += 'origin = ["0 nm", "0 nm", "5 nm"]\n'
    flow = parse(text).flow
    origin = [0, 0, 5]
    expected = Flow([1e-9, 0, 0], origin=origin) + Flow.shear(1e-11, origin=origin)
    expected += Flow.extension(-2e-12, origin=origin)
    for point in ([1, 2, 3], [-50, 0, 70]):
        np.testing.assert_allclose(flow.at(point), expected.at(point), rtol=1e-12)
    rows = '[["0 1/s", "1 1/s", "0 1/s"], ["0 1/s", "2 1/s", "0 1/s"], ["0 1/s", "0 1/s", "-2 1/s"]]'
    np.testing.assert_allclose(parse(f"[flow]\ngradient = {rows}\n").flow.gradient[0], [0, 1e-12, 0])
    simulation, one = create_simulation(parse(text))
    assert one.filaments.in_context(simulation.context).flow() == flow
    assert_refused("line 9: .flow. says nothing", "[flow]\n")
    assert_refused(
        "line 10: .flow. The gradient of the flow has the trace", f"[flow]\ngradient = {rows.replace('-2', '2')}\n"
    )
    assert_refused(
        "direction and gradient_direction must be perpendicular", '[flow]\nshear = "1 1/s"\ndirection = [0, 0, 1]\n'
    )


def test_rings_planar_and_propelled_filaments():
    text = FILAMENT + 'closed = true\nnormal = [1, 0, 0]\nposition = ["9 nm", "8 nm", "7 nm"]\n' + FILAMENT
    text += 'planar = true\nheight = "40 nm"\ncount = 4\npropulsion = "-0.1 pN"\n'
    own = built(filament=text)
    ring, *planar = own.filaments
    assert ring.closed and ring.segments == 6
    np.testing.assert_allclose(ring.positions.mean(axis=0), (9, 8, 7), atol=1e-9)
    np.testing.assert_allclose(ring.positions[:, 0], 9)
    for filament in planar:
        assert filament.planar and set(filament.positions[:, 2]) == {40.0}
        assert filament.propulsion == pytest.approx(-0.1 * PN)
    # Turned by chance.
    assert np.ptp([filament.positions[1, 1] - filament.positions[0, 1] for filament in planar]) > 10


def test_places_in_a_region():
    regions = {
        'shape = "sphere", radius = "600 nm"': lambda x: np.linalg.norm(x, axis=1) <= 600,
        'shape = "cylinder", axis = [0, 0, 1], radius = "250 nm", length = "1.5 um"': lambda x: (
            (np.hypot(x[:, 0], x[:, 1]) <= 250) & (abs(x[:, 2]) <= 750)
        ),
        'shape = "capsule", axis = [1, 1, 0], radius = "250 nm", length = "1 um"': lambda x: (
            Capsule([0, 0, 0], [1, 1, 0], 1000, 250).square_depth(x) == 0
        ),
        'shape = "torus", axis = [1, 1, 0], major_radius = "700 nm", minor_radius = "220 nm"': lambda x: (
            Torus([0, 0, 0], [1, 1, 0], 700, 220).square_depth(x) == 0
        ),
        'shape = "box", lower = ["0 um", "0 um", "0 um"], upper = ["1 um", "1 um", "1 um"]': lambda x: (
            (x >= 0) & (x <= 1000)
        ).all(axis=1),
    }
    for region, inside in regions.items():
        own = built(filament=FILAMENT + f"count = 12\ninside = {{ {region} }}\n")
        assert all(inside(filament.positions).all() for filament in own.filaments)
        middles = np.array([filament.positions.mean(axis=0) for filament in own.filaments])
        assert np.ptp(middles, axis=0).min() > 50
    own = built(filament=FILAMENT + 'concentration = "50 1/um^3"\ninside = { shape = "sphere", radius = "600 nm" }\n')
    assert len(own.filaments) == round(50 * 4 / 3 * np.pi * 0.6**3)
    with pytest.raises(InputError, match="line 8: .*filament 0 of 6 segments does not fit into its region"):
        built(filament=FILAMENT + 'inside = { shape = "sphere", radius = "200 nm" }\n')


def test_concentrations_of_monomers():
    """Of a volume of 8 um^3, 602.214 monomers in each uM and um^3, and mean lengths of 500 nm."""
    own = FILAMENT.replace("6", "[4, 6]")
    (four, six) = parse(BOX, filament=own + 'monomer_concentration = "2 uM"\n').filaments
    assert (four.count, six.count) == (27, 26) and round(2 * 602.214 * 8 * 2.73 / 500) == 53
    length = 'monomer_concentration = "2 uM"\nmonomer_length = "5.46 nm"\n'
    assert sum(group.count for group in parse(BOX, filament=own + length).filaments) == 105
    tubes = FILAMENT.replace("F_ACTIN", "MICROTUBULE") + 'monomer_concentration = "1 uM"\n'
    (group,) = parse(BOX, filament=tubes).filaments
    assert group.count == round(602.214 * 8 / 13 * 8 / 600)
    unknown = FILAMENT.replace('type = "F_ACTIN"', 'name = "OWN"\ndiameter = "7 nm"\npersistence_length = "9 um"')
    unknown += 'stretching_modulus = "20 nN"\nmonomer_concentration = "1 uM"\n'
    with pytest.raises(InputError, match='needs the length of a monomer .* monomer_length = "2.7 nm"'):
        parse(BOX, filament=unknown)


LINKERS = '[[linkers]]\ntype = "ALPHA_ACTININ"\ncount = 20\n'
VOLUMES = {
    'shape = "sphere"\nradius = "500 nm"': (4 / 3 * np.pi * 0.5**3, 4 / 3 * np.pi * 0.5**3),
    'shape = "ellipsoid"\nsemi_axes = ["500 nm", "400 nm", "300 nm"]': (0.08 * np.pi, 0.08 * np.pi),
    'shape = "box"\nlower = ["0 um", "0 um", "0 um"]\nupper = ["1 um", "2 um", "1 um"]': (2.0, 2.0),
    'shape = "capsule"\nradius = "300 nm"\nlength = "1 um"': (0.126 * np.pi, 0.126 * np.pi),
    'shape = "torus"\nmajor_radius = "500 nm"\nminor_radius = "200 nm"\naxis = [1, 2, 0]': (0.04 * np.pi**2,) * 2,
    'shape = "slit"\nthickness = "200 nm"\nnormal = [0, -2, 0]': (None, 0.8),
    'shape = "cylinder"\nradius = "200 nm"\naxis = [0, 0, 1]': (None, np.pi * 0.08),
    # Larger than the box, askew, or of one side.
    'shape = "sphere"\nradius = "1.1 um"': (4 / 3 * np.pi * 1.1**3, None),
    'shape = "slit"\nthickness = "3 um"': (None, None),
    'shape = "slit"\nthickness = "200 nm"\nnormal = [1, 1, 0]': (None, None),
    'shape = "cylinder"\nradius = "1.1 um"': (None, None),
    'shape = "plane"': (None, None),
}


@pytest.mark.parametrize("wall", VOLUMES)
def test_linkers_that_are_unbound_are_within_walls(wall):
    """Without a box and with one of 2 um, whose own volume is not theirs."""
    table = f'[[wall]]\n{wall}\nstiffness = "0.1 pN/nm"\n'
    for box, volume in zip(("", BOX), VOLUMES[wall]):
        if volume is None:
            with pytest.raises(InputError, match=r"line \d+: .*number 1: Linkers that are not bound .* volume ="):
                parse(box, table, LINKERS)
        else:
            assert parse(box, table, LINKERS).linkers[0].volume == pytest.approx(1e9 * volume)
        assert parse(box, table, LINKERS + 'volume = "3 um^3"\n').linkers[0].volume == pytest.approx(3e9)
        with pytest.raises(InputError, match="does not say"):
            parse(box, table, table, LINKERS)


def test_nematic_order_and_lengths_in_turn():
    text = FILAMENT.replace("6", "[3, 5, 3, 8]") + 'count = 401\ndirection = [0, 3, 0]\norientation = "nematic"\n'
    own = built(BOX, filament=text + 'start = "straight"\n')
    lengths = [filament.segments for filament in own.filaments]
    assert [lengths.count(n) for n in (3, 5, 8)] == [201, 100, 100]
    signs = np.array([np.sign(filament.positions[-1] - filament.positions[0])[1] for filament in own.filaments])
    # Four standard errors of 401 coins.
    assert abs(signs.mean()) < 4 / np.sqrt(401)
    assert set(signs) == {-1.0, 1.0}
    configuration = parse(BOX, PULL.replace("filament = 1", "table = 1"), filament=text)
    assert configuration.pulls[0].filaments == tuple(range(401))


def test_particles():
    text = '[[particles]]\nname = "COL"\ndiameter = "40 nm"\ncount = 30\ndiffusion = "2 um^2/s"\n'
    own = built(BOX, text, text.replace("COL", "FIX") + "fixed = true\n")
    kT = 8.31446261815324e-3 * 310
    np.testing.assert_allclose(own.particle_friction, kT / 2e-6, rtol=1e-6)
    masses = [own.system.getParticleMass(index)._value for index in range(21, 81)]
    assert masses == [1.0] * 30 + [0.0] * 30
    places = own.positions._value[21:]
    assert (places >= 0).all() and (places <= 2000).all()
    assert [residue.name for residue in own.topology.residues()][-1] == "FIX"
    step = own.filaments.recommended_time_step(system=own.system, **own.arguments())
    assert step.step > 0


@pytest.mark.parametrize(
    ("before", "lines", "message"),
    [
        ("", 'diffusion = "1 um^2/s"\n', "need a region"),
        ("", 'diffusion = "-1 um^2/s"\n', "diffusion"),
        (BOX, 'diffusion = "1 um^2/s"\nvolume = "1 um^3"\n', "neither a volume"),
        (BOX, "planar = true\n", "give their diffusion"),
        (BOX, 'inside = { shape = "sphere", radius = "1 um" }\n', "give their diffusion"),
        ("", 'diffusion = "1 um^2/s"\ninside = { shape = "cylinder", radius = "1 um" }\n', "length"),
    ],
)
def test_regions_of_linkers_that_diffuse_are_checked(before, lines, message):
    with pytest.raises(InputError, match=message):
        parse(before, LINKERS + lines)


def test_linkers_that_diffuse():
    own = 'diffusion = "2 um^2/s"\nplanar = true\ninside = { shape = "cylinder", radius = "1 um", length = "2 um" }\n'
    (linkers,) = built("", LINKERS + own).filaments.linkers
    assert linkers.diffusion == pytest.approx(2e-6) and linkers.planar and linkers.volume is None
    cylinder, slab = linkers.region
    assert cylinder.radius == 1000.0 and slab.thickness == 2000.0
    assert built(BOX, LINKERS + 'diffusion = "2 um^2/s"\n').filaments.linkers[0].region == ()


def test_particles_and_linkers_have_a_recommended_step():
    tables = BOX + PARTICLES + '[[linkers]]\ntype = "ALPHA_ACTININ"\ncount = 5\n'
    assert parse(tables, simulation=TAIL.replace('"1 us"', '"recommended"')).simulation.time_step > 0


def test_anchors_at_random_places():
    text = '[[linkers]]\nname = "m"\nstiffness = "0.1 pN/nm"\nhand = { binding_rate = "1 1/s", reach = "9 nm", '
    text += 'unbinding_rate = "1 1/s" }\nanchors = { count = 500, lower = ["0 um", "0 um", "3 nm"], '
    text += 'upper = ["1 um", "2 um", "3 nm"] }\n'
    anchors = built(BOX, text).filaments.linkers[0].anchors
    assert anchors.shape == (500, 3) and set(anchors[:, 2]) == {3.0}
    np.testing.assert_allclose(anchors.mean(axis=0)[:2], [500, 1000], atol=4 * 2000 / np.sqrt(12 * 500))
    two = built(BOX, text + text).filaments.linkers
    assert not np.array_equal(two[0].anchors, two[1].anchors)


def energy_of(system, positions, temperature):
    context = openmm.Context(system, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    return context.getState(energy=True).getPotentialEnergy()._value / (8.31446261815324e-3 * temperature)


def test_filaments_with_contacts_come_apart_before_the_run():
    text = FILAMENT + 'count = 40\ninside = { shape = "sphere", radius = "400 nm" }\n'
    configuration = parse(CONTACTS, filament=text)
    one = build_system(configuration, None, 3)
    overlaps = [f for f in one.system.getForces() if f.getName() == "CylinderChainContactForce"]
    assert len(overlaps) == 1

    before, relaxed = one.positions, relaxed_positions(configuration, one)
    # Equilibrium of 240 segments and 200 joints has about 320 k_B T, contacts a few tens.
    assert energy_of(one.system, before, 310) > 700 > 500 > energy_of(one.system, relaxed, 310)
    np.testing.assert_array_equal(relaxed._value, relaxed_positions(configuration, one)._value)
    kept = parse(CONTACTS + "relax = false\n", filament=text)
    assert relaxed_positions(kept, one) is before


OVERLAPPING = """
[solvent]
temperature = "298 K"
viscosity = "1 mPa*s"
[box]
edges = ["1 um", "1 um", "1 um"]
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = 10
count = 60
[contacts]
diameter = "15 nm"
[simulation]
time_step = "10 us"
duration = "100 ms"
report_interval = "2 ms"
seed = 1
platform = "CPU"
checks = false
"""


def test_filaments_come_apart_in_short_steps_where_those_of_the_run_are_far_too_long():
    # A solvent of a hundred-thousandth of the viscosity of water, where 17 ps are recommended.
    configuration = parse_configuration(OVERLAPPING.replace("1 mPa", "1e-05 mPa"))
    one = build_system(configuration, None, 1)
    before, after = (energy_of(one.system, x, 298) for x in (one.positions, relaxed_positions(configuration, one)))
    # Equilibrium of 600 segments and 540 joints has about 840 k_B T, of which chance takes 29 either way.
    assert before > 1200 > 1000 > after


TWO_IN_A_SPHERE = FILAMENT + 'count = 2\ninside = { shape = "sphere", radius = "400 nm" }\n'


def test_a_start_that_takes_long_says_how_far_it_is(monkeypatch, capsys):
    # Each of 60 steps takes an eighth of a second here, so that lines come after 2, 4 and 6 s.
    clocked = functools.partial(LateMessages, clock=itertools.count(0.0, 0.125).__next__)
    monkeypatch.setattr("openmm_cylchain.runs.relaxation.LateMessages", clocked)
    configuration = parse(CONTACTS, filament=TWO_IN_A_SPHERE)
    one, messages = build_system(configuration, None, 3), []
    relaxed_positions(configuration, one, messages.append)
    line = "filaments that overlap come apart before the first step: {} of at most 2060 steps"
    assert messages == [line.format(steps) for steps in (16, 32, 48)]
    assert capsys.readouterr() == ("", "")
    relaxed_positions(configuration, one)
    said = capsys.readouterr().err.splitlines()
    assert [text.split(" s  ")[1] for text in said] == messages


def test_a_start_that_is_soon_done_says_nothing(capsys):
    configuration = parse(CONTACTS, filament=TWO_IN_A_SPHERE)
    relaxed_positions(configuration, build_system(configuration, None, 3))
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", ["npy", "npz", "cif", "dcd"])
def test_start_from_a_file(tmp_path, suffix):
    first = tmp_path / "first"
    text = HEAD + FILAMENT + "count = 2\n" + FILAMENT.replace("segments = 6", "segments = 4") + TAIL
    (tmp_path / "first.toml").write_text(text)
    run(read_configuration(tmp_path / "first.toml"), first)
    trajectory = mdtraj.load_dcd(str(first / "trajectory.dcd"), top=str(first / "topology.cif"))
    shapes = [trajectory.xyz[:, nodes] for nodes in (range(7), range(7, 14), range(14, 19))]
    extra, frame = "", -1
    if suffix == "npy":
        np.save(tmp_path / "start.npy", np.stack([shapes[0][-1], shapes[1][-1]]))
        expected = shapes[:2]
    elif suffix == "npz":
        np.savez(tmp_path / "start.npz", a=shapes[2][-1], b=np.stack([shapes[0][-1], shapes[1][-1]]))
        expected = [shapes[2], *shapes[:2]]
    else:
        name = {"cif": "topology.cif", "dcd": "trajectory.dcd"}[suffix]
        (tmp_path / f"start.{suffix}").write_bytes((first / name).read_bytes())
        extra, frame, expected = (
            ("", 0, shapes) if suffix == "cif" else ('topology = "first/topology.cif"\n', 4, shapes)
        )
        extra += "frame = 4\n" if suffix == "dcd" else ""
    keys = f'[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nfile = "start.{suffix}"\n{extra}'
    (tmp_path / "next.toml").write_text(HEAD + keys + TAIL)
    configuration = read_configuration(tmp_path / "next.toml")
    starts = [filament.positions for filament in build_system(configuration, None, 1).filaments]
    expected = sorted((shape[frame] for shape in expected), key=len, reverse=len(expected[0][0]) == 7)
    for start, shape in zip(starts, expected):
        np.testing.assert_allclose(start, shape, atol=2e-3)
    # A run has copies, and goes on without the originals.
    run(configuration, tmp_path / "next")
    group, *_ = summarise(configuration, load_trajectory(configuration, RunDirectory(tmp_path / "next")))
    assert not group.in_equilibrium and any("Started from a file" in note for note in group.notes)
    (tmp_path / f"start.{suffix}").unlink()
    kept = read_configuration(tmp_path / "next" / "configuration.toml")
    assert changed_keys(configuration, kept) == []
    run(kept, tmp_path / "next", resume=True)
    with pytest.raises(InputError, match=r"next.toml, line 7: .* file .* does not exist"):
        read_configuration(tmp_path / "next.toml")


def test_files_that_do_not_fit_are_refused(tmp_path):
    def refused(message, content, extra="", name="x.npy"):
        if isinstance(content, bytes):
            (tmp_path / name).write_bytes(content)
        elif content is not None:
            np.save(tmp_path / name, content)
        keys = f'[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nfile = "{name}"\n{extra}'
        assert_refused(message, filament=keys, folder=tmp_path)

    line = np.arange(5)[:, None] * [100.0, 0, 0]
    refused("line 7: .* cannot be read", b"not an array")
    refused("must be two nodes or more of three finite", line[:, :2])
    refused("must be two nodes or more of three finite", np.where(line == 400, np.nan, line))
    refused("must be two nodes or more", line[:1])
    refused("has segments of 1000 to 1000 nm, but those of ACT are of 100 nm", 10 * line)
    refused("line 8: .*segments cannot be with a file", line, "segments = 4\n")
    refused("has 1 filaments, counted from 0, and no number 1", line, "filaments = [0, 1]\n")
    refused("give a topology for a trajectory, and only for one", line, 'topology = "x.cif"\n')
    refused("has no frames", line, "frame = 3\n")
    refused("must be a .npy, .npz, .cif, .pdb, .dcd, .xtc file", b"", name="x.txt")
    refused("does not exist", None, name="y.npy")
    refused("cannot be read", b"garbage", name="x.npz")
    refused("cannot be read", b"garbage", name="x.cif")


def test_exact_extension_under_tension(tmp_path):
    """In the summary, beside the exact one, of single segments, which are soon in equilibrium."""
    text = FILAMENT.replace("segments = 6", 'segments = 1\nbending_rigidity = "0 pN*nm^2"') + "count = 150\n"
    tail = TAIL.replace("100 us", "16 ms").replace("10 us", "0.4 ms").replace("1 us", "40 us")
    pull = PULL.replace("filament = 1", "table = 1").replace("2 pN", "0.2 pN")
    configuration = parse(pull, filament=text, simulation=tail)
    run(configuration, tmp_path)
    (group,) = summarise(configuration, load_trajectory(configuration, RunDirectory(tmp_path)))
    (observable,) = [one for one in group.observables if "extension along" in one.name]
    exact = theory.chain_extension(configuration.filaments[0].type, 1, 0.2 * PN, 310.0)
    assert observable.theory == pytest.approx(exact)
    assert abs(observable.deviation) < 4.0 and observable.standard_error < 0.05 / 4 * exact
    assert observable.verdict in ("agrees", "within 5 %")


def test_walls_hold_types_of_filaments():
    """Those that begin later on, too, and no particles; only walls of all are around what is between filaments."""
    tubes = FILAMENT.replace("F_ACTIN", "MICROTUBULE").replace("segments = 6", "segments = 2")
    actin = FILAMENT.replace("100 nm", "108 nm")
    growing = f"{MONOMERS}{actin}reserve = 1\n{GROWTH}{tubes}count = 2\n"
    own = built(WALL, WALL + 'holds = "F_ACTIN"\n', WALL + 'holds = ["MICROTUBULE"]\n', PARTICLES, filament=growing)
    walls = list(filter(None, map(as_filament_wall_force, own.system.getForces())))
    held = [{wall.getParticle(index) for index in range(wall.getNumParticles())} for wall in walls]
    actin, tubes = (
        {node for filament, nodes in zip(own.filaments, own.filaments.node_indices) if of(filament) for node in nodes}
        for of in (lambda one: one.growth is not None, lambda one: one.growth is None)
    )
    everything = set(range(own.system.getNumParticles()))
    assert held == [everything, actin, tubes] and len(everything - actin - tubes) == 2
    assert sum(filament.growth is not None for filament in own.filaments) == 2
    assert_refused(
        "names DNA, but filaments, bodies and particles of the configuration are ACT", WALL + 'holds = "DSDNA"\n'
    )
    assert_refused("which nothing says", WALL + 'holds = "F_ACTIN"\n', LINKERS)
    volume = parse(WALL, WALL.replace("2 um", "1 um") + 'holds = "F_ACTIN"\n', LINKERS).linkers[0].volume
    assert volume == pytest.approx(4e9 / 3 * np.pi * 8)
    simulation = TAIL.replace("1 us", "10 ns", 1) + 'engine = "portable"\n'
    own = build_system(parse(WALL + 'holds = "F_ACTIN"\n', PARTICLES, simulation=simulation), "portable", 3)
    (wall,) = (force for force in own.system.getForces() if force.getName() == "Wall (sphere)")
    assert wall.getNumParticles() == 21


BODY = '[[body]]\nname = "POLE"\npositions = [["0 um", "0 um", "0 um"]]\n'
DUMBBELL = BODY + 'points = [["50 nm", "0 nm", "0 nm"], ["-50 nm", "0 nm", "0 nm"]]\nradii = ["30 nm", "30 nm"]\n'


def _walls_of(*tables):
    """Sides, particles and radii of walls, by their parts of the System."""
    own = built(*tables)
    found = [wall for wall in map(as_filament_wall_force, own.system.getForces()) if wall is not None]
    rows = []
    for wall in found:
        held = range(wall.getNumParticles())
        radii = {wall.getParticleRadius(index)._value for index in held}
        rows.append((wall.getSide(), [wall.getParticle(index) for index in held], radii))
    return own, rows


def test_sides_of_walls_and_what_they_hold():
    surface, beads = 'side = "surface"\n', PARTICLES.replace("[[particles]]\n", '[[particles]]\nname = "BEAD"\n')
    own, walls = _walls_of(
        WALL,
        WALL + surface + 'holds = ["POLE", "BEAD"]\n',
        WALL + surface + 'nodes = "first"\nholds = ["F_ACTIN", "POLE"]\ndistance = "5 nm"\n',
        WALL.replace("2 um", "10 nm") + 'side = "outside"\nnodes = "ends"\nholds = "F_ACTIN"\ndistance = "20 nm"\n',
        DUMBBELL,
        beads,
    )
    nodes, bodies = own.filaments.node_indices, own.filaments.body_indices[0][:2]
    assert [side for side, _, _ in walls] == ["inside", "surface", "surface", "outside"]
    of_beads = set(range(own.system.getNumParticles())) - set(np.concatenate([*nodes, own.filaments.body_indices[0]]))
    assert set(walls[1][1]) == of_beads | set(bodies) and walls[1][2] == {0.0}
    assert set(walls[2][1]) == {*(one[0] for one in nodes), bodies[0]} and walls[2][2] == {5.0, 0.0}
    assert set(walls[3][1]) == {one[end] for one in nodes for end in (0, -1)} and walls[3][2] == {20.0}
    slit = '[[wall]]\nshape = "slit"\nthickness = "1 um"\nstiffness = "1 pN/nm"\n'
    assert_refused("several faces", slit + surface)
    assert_refused('must be "all" or "first" for the body POLE', WALL + 'nodes = "ends"\n', DUMBBELL)
    growing = f"{MONOMERS}{FILAMENT.replace('100 nm', '108 nm')}reserve = 1\n{GROWTH}"
    assert_refused('must be "all" for filaments that grow', WALL + 'nodes = "last"\n', filament=growing)
    # What is outside leaves a volume that nobody knows, and a surface leaves all.
    assert_refused("which what there is", WALL, WALL + 'side = "outside"\n', LINKERS)
    assert parse(WALL, WALL + surface, LINKERS).linkers[0].volume == pytest.approx(4e9 / 3 * np.pi * 8)
    simulation = TAIL.replace("1 us", "10 ns", 1) + 'engine = "portable"\n'
    assert_refused("side needs the compiled engine", WALL + surface, simulation=simulation)


def test_portable_engine_has_walls_links_and_pulls():
    simulation = TAIL.replace("1 us", "10 ns", 1) + 'engine = "portable"\n'
    own = build_system(parse(WALL, LINK, PULL, TETHER, PARTICLES, simulation=simulation), "portable", 3)
    names = [force.getName() for force in own.system.getForces()]
    assert "Wall (sphere)" in names and "ConstantForce" in names and "Crosslinks" in names
    filaments = by_hand([filament.positions for filament in own.filaments], "portable")
    filaments.build()
    expected = wall_force(Sphere([0, 0, 0], 2000), 0.1 * PN, range(23))
    mine = own.system.getForces()[names.index("Wall (sphere)")]
    assert openmm.XmlSerializer.serialize(mine) == openmm.XmlSerializer.serialize(expected)
    assert_refused("engine has no [contacts]", CONTACTS, simulation=simulation)
    assert_refused("distance needs the compiled engine", WALL + 'distance = "1 nm"\n', simulation=simulation)


@pytest.mark.parametrize(
    ("table", "old", "new", "message"),
    [
        (WALL, "sphere", "spher", "[[wall]] number 1: shape must be one of .* Did you mean 'sphere'"),
        (WALL, 'radius = "2 um"\n', "", "line 9: [[wall]] number 1: lacks the key 'radius'"),
        (
            WALL,
            "radius",
            "thickness",
            "line 11: [[wall]] number 1: thickness is none of a sphere: that has center, radius",
        ),
        (WALL, "2 um", "2 s", "line 11: [[wall]] number 1: radius has the unit s, which is not one of length"),
        (
            WALL,
            "stiffness",
            'distance = "9 um"\nstiffness',
            "line 12: [[wall]] number 1: distance must be below 2000 nm",
        ),
        (WALL, "0.1 pN/nm", "0 pN/nm", "line 12: [[wall]] number 1: stiffness must be positive"),
        (WALL, "[[wall]]", "[wall]", "'wall' must be a list of tables"),
        (LINK, "filament = 0", "filament = 3", "line 10: .*between[0] filament 3 does not exist; there are 3"),
        (LINK, "150 nm", "650 nm", "line 10: .*arc_length is beyond the end of the filament, which is 600 nm"),
        (LINK, "node = -1", "node = 7", "between[1] node 7 does not exist in filament 1; there are 7"),
        (LINK, "node = -1", "segment = 6", "segment 6 does not exist; there are 6"),
        (LINK, "node = -1", "segment = 1, fraction = 2", "fraction must be between 0 and 1"),
        (LINK, "node = -1", "fraction = 0.5", "lacks a place on the filament"),
        (LINK, ", node = -1", "", "lacks a place on the filament"),
        (LINK, "node = -1", 'point = ["0 nm", "0 nm", "0 nm"]', "filament cannot be with a point"),
        (LINK, "node = -1", "node = 1, segment = 2", "segment and node say the same|node and segment say the same"),
        (LINK, "stiffness", 'within = "3 nm"\nstiffness', "within and between say the same: give one"),
        (LINK, "stiffness", "count = 3\nstiffness", "count belongs to random links"),
        (LINK, "between", "betwen", "unknown key 'betwen'. Did you mean 'between'"),
        (LINK, "stiffness", 'model = "fene"\nstiffness', "maximum_extension must be given"),
        (TETHER, "filament = 0", "table = 2", "line 10: .*table is 2, but there is no such"),
        (TETHER, "filament = 0", "", "line 9: [[tether]] number 1: lacks the key 'filament'"),
        (TETHER, "filament = 0", "filament = 3", "filament 3 does not exist; there are 3"),
        (TETHER, "node = -1", "node = 9", "line 11: .*node 9 does not exist in filament 0; there are 7"),
        (TETHER, "filament = 0", "filament = [0, 0]", "must name different filaments"),
        (PULL, 'tension = "2 pN"', "", "lacks the key 'tension'"),
        (
            PULL,
            'tension = "2 pN"',
            'tension = "2 pN"\nforce = ["1 pN", "0 pN", "0 pN"]',
            "force and tension say the same",
        ),
        (PULL, 'tension = "2 pN"', 'force = ["1 pN", "0 pN", "0 pN"]', "lacks the key 'node'"),
        (PULL, 'tension = "2 pN"', 'tension = "2 pN"\nnode = 1', "node belongs to a force"),
        (CONTACTS, "15 nm", "-15 nm", "line 10: [contacts] diameter must be positive"),
        (CONTACTS, "15 nm", "0.1 nm", "line 10: .*diameter is 0.1 nm, but filaments are 6 nm thick"),
        (CONTACTS, "diameter", "diametre", "Did you mean 'diameter'"),
        (PARTICLES, "50 nm", "50 um^2", "diameter has the unit"),
        (PARTICLES, "[[particles]]", '[[particles]]\nname = "NOD"', "'NOD' is that of nodes"),
        (PARTICLES, "positions = [", "count = 3\npositions = [", "positions and count say the same"),
        (PARTICLES, '["0 nm", "0 nm", "1 um"], ', "[], ", "positions[0] must be a list of three"),
        (PARTICLES, "diameter", 'friction = "1e-9 kg/s"\ndiffusion = "1 um^2/s"\ndiameter', "say the same"),
    ],
)
def test_mistakes_are_named_with_their_lines(table, old, new, message):
    assert old in table
    escaped = "|".join(re.escape(part).replace(r"\.\*", ".*").replace(r"\ ", " ") for part in message.split("|"))
    with pytest.raises(InputError) as caught:
        parse(table.replace(old, new, 1))
    assert re.search(escaped, str(caught.value)), caught.value


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("closed = true\nsegments = 3", "line 8: .*segments must be at least 4 in a ring"),
        ('closed = true\nsegments = 9\nstart = "straight"', "line 9: .*start cannot be with closed"),
        ("segments = 9\nnormal = [1, 0, 0]", "normal belongs to closed = true"),
        ('segments = 9\nheight = "1 nm"', "height belongs to planar = true"),
        ("segments = 9\nplanar = true\ndirection = [0, 0, 1]", "direction must lie in the xy plane"),
        ("segments = 9\nplanar = true\nclosed = true\nnormal = [1, 0, 0]", "normal must be along z"),
        ('segments = 9\norientation = "nematic"', "orientation needs a direction"),
        ('segments = 9\ncount = 3\nconcentration = "1 uM"', "concentration and count say the same"),
        ('segments = 9\nconcentration = "1 uM"', "concentration needs a volume"),
        ('segments = 9\nmonomer_concentration = "1 uM"', "monomer_concentration needs a volume"),
        ('segments = 9\nmonomer_concentration = "1 uM"\nconcentration = "1 uM"', "and concentration say the same"),
        ('segments = 9\ncount = 3\nmonomer_concentration = "1 uM"', "monomer_concentration and count say the same"),
        ('segments = 9\nmonomer_length = "2 nm"', "monomer_length belongs to monomer_concentration"),
        (
            'segments = 9\nmonomer_concentration = "1 nM"\ninside = { shape = "sphere", radius = "1 um" }',
            r"makes 0.007652 filaments of 329.7 monomers each in a volume of 4.189 um\^3",
        ),
        ("segments = [3, 0]", r"segments\[1\] must be at least 1"),
        ("segments = []", "segments must be a list of whole numbers, as in"),
        ("segments = 10000000\ncount = 3", "makes 3e.07 nodes: there can be 1e.07 in all"),
        ("segments = 100000000000000000000", "segments must be at most 10000000"),
        ('segments = 9\ninside = { shape = "plane" }', "inside shape must be one of sphere, cylinder"),
        ('segments = 9\ninside = { shape = "cylinder", radius = "1 um" }', "inside lacks the key 'length'"),
        ('segments = 9\npropulsion = "1 pN/nm"', "propulsion has the unit"),
        ('segments = 9\nposition = ["1e308 nm", "0 nm", "0 nm"]', r"position\[0\] is .1e308 nm., which is too large"),
        ("segments = 9\nframe = 3", "frame belongs to a file"),
        ("count = 9", "lacks the key 'segments': add a line such as segments = "),
    ],
)
def test_mistakes_in_filaments_are_named(keys, message):
    with pytest.raises(InputError, match=message):
        parse(filament=f'[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\n{keys}\n')


def test_changes_of_every_table_are_named():
    texts = [BOX, WALL, LINK, TETHER, PULL, CONTACTS, PARTICLES, '[flow]\nshear = "1 1/s"\n']
    changes = [("2 um", "3 um"), ("2 um", "3 um"), ("node = -1", "node = 1"), ("0.1", "0.2"), ("2 pN", "3 pN")]
    changes += [("15 nm", "16 nm"), ("50 nm", "60 nm"), ('"1 1/s"', '"2 1/s"')]
    names = ["[box] edges", "[[wall]] number 1: radius", "[[link]] number 1: between"]
    names += ["[[tether]] number 1: stiffness", "[[pull]] number 1: tension", "[contacts] diameter"]
    names += ["[[particles]] number 1: diameter", "[flow] shear"]
    first = parse(*texts)
    assert changed_keys(first, parse(*texts)) == []
    for number, (change, name) in enumerate(zip(changes, names)):
        other = list(texts)
        other[number] = other[number].replace(*change, 1)
        assert changed_keys(first, parse(*other)) == [name]
    without = parse(*texts[:-1])
    assert changed_keys(first, without) == ["[flow]"]


TRICKY = '''a = 1 # x = 3
"b c".d = "x # \\" ]"
[t]
x = [1, # one
  [2, "]"],
]
y = {p = 1, q.r = [3], s = \'\'\'a
b\'\'\'}
z = """
[no]
k = \\"""" # end
[[f]]
n = 1979-05-27 07:32:00
[f.sub]
m=2
[[f]]
[[f.g]]
h = true
[[f.g]]
h = ""
[f."sub".deep]
o = \'\'
[t.later]
w = """a""""
'''


def test_lines_of_toml():
    lines = lines_of(TRICKY, tomllib.loads(TRICKY))
    expected = {("a",): 1, ("b c", "d"): 2, ("t",): 3, ("t", "x"): 4, ("t", "x", 1, 1): 5, ("t", "y", "q", "r"): 7}
    expected |= {("t", "y", "s"): 7, ("t", "z"): 9, ("f", 0): 12, ("f", 0, "n"): 13, ("f", 0, "sub", "m"): 15}
    expected |= {("f", 1): 16, ("f", 1, "g", 0): 17, ("f", 1, "g", 1, "h"): 20, ("f", 1, "sub", "deep", "o"): 22}
    expected |= {("t", "later", "w"): 24}
    for path, line in expected.items():
        assert lines[path] == line, path
    # Nothing is said where what is found is not what was read.
    assert lines_of(TRICKY, {"a": 1}) == {}


def test_lines_with_carriage_returns():
    text = (HEAD + FILAMENT.replace("segments", "segmnts") + TAIL).replace("\n", "\r\n")
    with pytest.raises(InputError, match="^line 7: "):
        parse_configuration(text)
