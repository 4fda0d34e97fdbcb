"""CylinderChainLinkForce: forces, places, links of Contexts, States and checkpoints, XML, and what is refused."""

import copy
import os
import pickle
import subprocess
import sys

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments
from openmm_cylchain.engines.compiled import plugin
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.platforms import ON_COMPILED_PLATFORMS
from support.repository import TESTS
from support.solvent import TEMPERATURE, VISCOSITY

LinkForce = plugin.CylinderChainLinkForce
HARMONIC, FENE = LinkForce.Harmonic, LinkForce.FENE
BOX = np.array([[3.0, 0.0, 0.0], [0.5, 3.1, 0.0], [-0.4, 0.6, 2.9]])
PARTICLES = 8
POINT = np.array([0.4, -1.2, 2.0])
# Particle, partner, fraction.
PLACES = [
    ((0, -1, 0.0), (1, -1, 0.0)),
    ((0, 1, 0.3), (2, -1, 0.0)),
    ((0, 1, 0.3), (3, 4, 0.75)),
    ((1, 2, 0.4), (0, 1, 0.9)),
    ((5, 6, 1.0), (7, -1, 0.0)),
]


def system_of(force, particles=PARTICLES):
    system = openmm.System()
    for _ in range(particles):
        system.addParticle(1.0)
    system.setDefaultPeriodicBoxVectors(*BOX)
    system.addForce(force)
    return system


def random_positions(seed=1, particles=PARTICLES):
    return np.random.default_rng(seed).uniform(-4, 4, (particles, 3))


def all_kinds(model=HARMONIC, rest_length=0.4, periodic=False):
    """A link for each pair of PLACES, and one from each first place to a point."""
    force = LinkForce()
    force.setUsesPeriodicBoundaryConditions(periodic)
    for first, second in PLACES:
        force.addLink(*first, *second, model, rest_length, 30.0, 12.0)
        force.addLinkToPoint(*first, openmm.Vec3(*POINT), model, rest_length, 20.0, 12.0)
    return force


def by_hand(positions, model, rest_length, periodic):
    """Energy of ``all_kinds``, with the nearest of many images."""
    shifts = np.array([[i, j, k] for i in range(-6, 7) for j in range(-6, 7) for k in range(-6, 7)]) @ BOX

    def place(which):
        first, second, fraction = which
        return positions[first] if second < 0 else (1 - fraction) * positions[first] + fraction * positions[second]

    energy = 0.0
    for first, second in PLACES:
        for k, end in ((30.0, place(second)), (20.0, POINT)):
            vector = end - place(first)
            d = np.linalg.norm(vector + shifts, axis=1).min() if periodic else np.linalg.norm(vector)
            e = d - rest_length
            energy += 0.5 * k * e**2 if model == HARMONIC else -0.5 * k * 12.0**2 * np.log(1 - (e / 12.0) ** 2)
    return energy


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("rest_length", [0.0, 0.4])
@pytest.mark.parametrize("model", [HARMONIC, FENE])
def test_energies_of_all_places_and_their_derivatives(model, rest_length, periodic, platform):
    # OpenMM's nearest image in a box that is this oblique is the nearest only of vectors that are short.
    positions = random_positions() * (0.3 if periodic else 1.0)
    force = all_kinds(model, rest_length, periodic)
    assert force.usesPeriodicBoundaryConditions() == periodic
    reference = system_of(copy.deepcopy(force))
    context = new_context(system_of(force), positions, platform=platform)
    if periodic:
        wrapped = positions + BOX[0] - 2 * BOX[2]
        wrapped[3:5] -= BOX[1]
        # The point stays where it is.
        context.setPositions(wrapped)
    tolerance = max(1e-12, platform.tolerance if platform.precision == "single" else 0)
    assert energy_of(context) == pytest.approx(by_hand(positions, model, rest_length, periodic), rel=tolerance)
    forces, at = forces_of(context), positions_of(context)
    assert np.abs(forces).max() > 10
    if platform.precision == "single":
        # Differences of energies are lost in the rounding of positions.
        expected = forces_of(new_context(reference, at))
        assert forces == pytest.approx(expected, abs=platform.tolerance * np.abs(forces).max())
        return
    for particle in range(PARTICLES):
        for axis in range(3):
            energies = []
            for step in (1e-5, -1e-5):
                moved = at.copy()
                moved[particle, axis] += step
                context.setPositions(moved)
                energies.append(energy_of(context))
            assert (energies[1] - energies[0]) / 2e-5 == pytest.approx(forces[particle, axis], rel=1e-6, abs=1e-5)


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("model", [HARMONIC, FENE])
def test_links_between_particles_are_stock_bonds(model, periodic, platform):
    pairs = [(0, 1), (0, 2), (0, 1), (4, 0), (3, 4), (2, 5)]
    force = LinkForce()
    stock = openmm.HarmonicBondForce() if model == HARMONIC else openmm.CustomBondForce("-15*9^2*log(1-((r-0.4)/9)^2)")
    for pair in pairs:
        force.addLink(pair[0], -1, 0.0, pair[1], -1, 0.0, model, 0.4, 30.0, 9.0)
        stock.addBond(*pair, *((0.4, 30.0) if model == HARMONIC else ()))
    for one in (force, stock):
        one.setUsesPeriodicBoundaryConditions(periodic)
    context = new_context(system_of(force), random_positions(), platform=platform)
    expected = new_context(system_of(stock), positions_of(context))
    forces = forces_of(expected)
    assert forces_of(context) == pytest.approx(
        forces, abs=(1e-7 if platform.precision else 1e-11) * np.abs(forces).max()
    )
    assert energy_of(context) == pytest.approx(energy_of(expected), rel=1e-12)


@ON_COMPILED_PLATFORMS
def test_places_on_segments_are_virtual_sites(platform):
    positions = random_positions()
    weights = [(0.7, 0.3), (0.25, 0.75)]
    sites = [(0, 1), (3, 4)]

    def system(force):
        one = system_of(force)
        for parents, weight in zip(sites, weights):
            site = one.addParticle(0.0)
            one.setVirtualSite(site, openmm.TwoParticleAverageSite(*parents, *weight))
        return one

    def stock():
        force = openmm.HarmonicBondForce()
        force.addBond(8, 9, 0.4, 30.0)
        force.addBond(8, 2, 0.4, 30.0)
        return force

    def linked():
        force = LinkForce()
        force.addLink(8, -1, 0.0, 9, -1, 0.0, HARMONIC, 0.4, 30.0, 0.0)
        force.addLink(8, -1, 0.0, 2, -1, 0.0, HARMONIC, 0.4, 30.0, 0.0)
        return force

    def direct():
        force = LinkForce()
        force.addLink(0, 1, 0.3, 3, 4, 0.75, HARMONIC, 0.4, 30.0, 0.0)
        force.addLink(0, 1, 0.3, 2, -1, 0.0, HARMONIC, 0.4, 30.0, 0.0)
        return force

    def results_of(force, platform=platform):
        context = new_context(system(force), np.vstack([positions, np.zeros((2, 3))]), platform=platform)
        context.computeVirtualSites()
        return [energy_of(context), *forces_of(context)[:8].ravel()]

    # On GPUs, OpenMM has rest lengths of bonds in single precision.
    expected = results_of(stock(), "Reference")
    bounds = {"rel": 1e-12, "abs": 1e-9}
    if platform.precision:
        bounds = {"rel": platform.tolerance, "abs": 30 * platform.tolerance}
    assert results_of(linked()) == pytest.approx(expected, **bounds)
    assert results_of(direct()) == pytest.approx(expected, **bounds)
    # The links are those of the parents: where a site is does not matter, as long as nobody computes it.
    context = new_context(system(linked()), np.vstack([positions, np.full((2, 3), 1e3)]), platform=platform)
    assert energy_of(context) == pytest.approx(expected[0], **bounds)
    # A link from a site to the same place on the segment has no length.
    force = LinkForce()
    force.addLink(8, -1, 0.0, 0, 1, 0.3, HARMONIC, 0.0, 1.0, 0.0)
    with pytest.raises(openmm.OpenMMException, match="Link 0 joins a place to itself.*virtual site at the other"):
        new_context(system(force), np.zeros((10, 3)))
    # Sites that are not between their parents stay sites.
    weights[0] = (1.5, -0.5)
    assert results_of(linked()) == pytest.approx(
        results_of(stock(), "Reference"), **{**bounds, "rel": max(1e-10, bounds["rel"])}
    )


@ON_COMPILED_PLATFORMS
def test_nearest_images_of_segments(platform):
    """Where a CylinderChainForce takes the ends of segments as nearest images, places are there, too."""
    for nearest in (False, True):
        chains, links = plugin.CylinderChainForce(), LinkForce()
        chains.addChain([0, 1], 0, HARMONIC, 1.0, 1e-9, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)
        chains.setUsesPeriodicBoundaryConditions(nearest)
        links.addLink(0, 1, 0.5, 2, -1, 0.0, HARMONIC, 0.0, 2.0, 0.0)
        links.setUsesPeriodicBoundaryConditions(True)
        system = system_of(links, 3)
        system.addForce(chains)
        positions = np.array([[0.1, 0, 0], [2.7, 0, 0], [0.1, 0, 0]])
        # The middle is at -0.1 or at 1.4.
        expected = 0.2**2 if nearest else 1.3**2
        assert energy_of(new_context(system, positions, platform=platform)) == pytest.approx(expected, abs=1e-6)


@ON_COMPILED_PLATFORMS
def test_links_without_length_or_direction(platform):
    force = LinkForce()
    force.addLink(0, -1, 0.0, 1, -1, 0.0, HARMONIC, 0.0, 10.0, 0.0)
    context = new_context(system_of(force), np.zeros((PARTICLES, 3)), platform=platform)
    assert energy_of(context) == 0 and np.all(forces_of(context) == 0)
    force.addLinkInContext(context, 0, -1, 0.0, 2, -1, 0.0, HARMONIC, 2.0, 10.0, 0.0)
    assert energy_of(context) == pytest.approx(20) and np.all(forces_of(context) == 0)


def test_forces_do_not_depend_on_threads():
    generator = np.random.default_rng(3)
    count, particles = 5000, 400
    ends = np.full((count, 4), -1)
    for row in range(count):
        ends[row] = generator.choice(particles, 4, replace=False)
    fractions = generator.uniform(size=(count, 2))
    force = LinkForce()
    system = system_of(force, particles)
    positions = generator.normal(size=(particles, 3))
    forces, energies = [], []
    for threads in ("1", "2", "5"):
        context = new_context(system, positions, platform="CPU", properties={"Threads": threads})
        parameters = np.tile([0.5, 3.0, 0.0], count)
        force.addLinksInContext(context, ends.ravel().tolist(), fractions.ravel().tolist(), [], [0] * count, parameters)
        forces.append(forces_of(context))
        energies.append(energy_of(context))
    assert np.abs(forces[0]).max() > 10
    for other in (1, 2):
        assert np.array_equal(forces[0], forces[other]) and energies[0] == energies[other]


def test_getters_and_setters():
    force = LinkForce()
    assert LinkForce.getStretchingModelNames() == ("harmonic", "fene")
    assert force.addLink(0, 1, 0.25, 2, -1, 0.7, HARMONIC, 5 * unit.angstrom, 30.0, 9.0) == 0
    assert force.addLinkToPoint(3, -1, 0.0, [1, 2, 3] * unit.nanometer, FENE, 0.0, 1.0, 2.0) == 1
    assert force.getNumLinks() == 2 and force.getLinkNumbers() == (0, 1) and force.getNextLinkNumber() == 2
    # A fraction of one particle, and a maximum extension of a harmonic link, have no effect and are not kept.
    *places, point = force.getLinkPlaces(0)
    assert places == [0, 1, 0.25, 2, -1, 0.0] and point == openmm.Vec3(0, 0, 0) * unit.nanometer
    nm, k = unit.nanometer, unit.kilojoule_per_mole / unit.nanometer**2
    assert force.getLinkParameters(0) == [HARMONIC, 0.5 * nm, 30.0 * k, 0.0 * nm]
    *places, point = force.getLinkPlaces(1)
    assert places == [3, -1, 0.0, -1, -1, 0.0] and point == openmm.Vec3(1, 2, 3) * nm
    assert force.getLinkParameters(1) == [FENE, 0.0 * nm, 1.0 * k, 2.0 * nm]
    force.setLinkPlaces(1, 4, 5, 0.5, 6, 7, 0.125)
    assert force.getLinkPlaces(1)[:6] == [4, 5, 0.5, 6, 7, 0.125]
    force.setLinkPlaces(0, 0, 1, 0.5, -1, -1, 0.0, openmm.Vec3(0, 0, 9))
    assert force.getLinkPlaces(0)[6] == openmm.Vec3(0, 0, 9) * nm
    force.setLinkParameters(0, FENE, 1.0, 2.0, 3.0)
    assert force.getLinkParameters(0) == [FENE, 1.0 * nm, 2.0 * k, 3.0 * nm]
    force.setLinkActive(0, False)
    assert not force.isLinkActive(0) and force.isLinkActive(1)
    assert force.getDefaultLinkParameters() == [HARMONIC, 0.0 * nm, 0.0 * k, 0.0 * nm]
    force.setDefaultLinkParameters(FENE, 1.0, 2.0, 3.0)
    assert force.getDefaultLinkParameters() == [FENE, 1.0 * nm, 2.0 * k, 3.0 * nm]
    force.removeLink(0)
    assert force.addLink(0, -1, 0, 1, -1, 0, HARMONIC, 0, 0, 0) == 2 and force.getLinkNumbers() == (1, 2)
    duplicate = LinkForce()
    duplicate.setLinks(*force.getLinks())
    assert duplicate.getLinks() == force.getLinks()
    for method in (force.getLinkPlaces, force.getLinkParameters, force.isLinkActive, force.removeLink):
        for number in (0, -1, 3):
            with pytest.raises(openmm.OpenMMException, match=f"Link {number} does not exist"):
                method(number)


def test_xml_and_copies():
    force = all_kinds(FENE)
    force.setForceGroup(3)
    force.setName("some links")
    force.setUsesPeriodicBoundaryConditions(True)
    force.setLinkActive(1, False)
    force.removeLink(0)
    force.removeLink(9)
    force.setDefaultLinkParameters(FENE, 0.1, 0.2, 0.3)
    xml = openmm.XmlSerializer.serialize(force)
    read = openmm.XmlSerializer.deserialize(xml)
    for other in (LinkForce.cast(read), copy.copy(force), copy.deepcopy(force), pickle.loads(pickle.dumps(force))):
        assert openmm.XmlSerializer.serialize(other) == xml
        assert other.getLinks() == force.getLinks() and other.getNextLinkNumber() == 10
        assert other.getName() == "some links" and other.getForceGroup() == 3
        assert other.usesPeriodicBoundaryConditions()
        assert other.getDefaultLinkParameters() == force.getDefaultLinkParameters()
    for bad, message in (
        (xml.replace('version="3"', 'version="2"', 2), "Unsupported version number"),
        (xml.replace('name="nextNumber" values="10 "', 'name="nextNumber" values="8 "'), "next number must be above"),
        (xml.replace('name="models" values="', 'name="models" values="7'), "illegal stretching model"),
        (xml.replace('name="numbers" values="', 'name="numbers" values="a '), "something else than numbers"),
        (xml.replace('name="ends"', 'name="places"'), "has no ends"),
    ):
        assert bad != xml
        with pytest.raises(openmm.OpenMMException, match=message):
            openmm.XmlSerializer.deserialize(bad)


def test_force_groups():
    force = all_kinds()
    force.setForceGroup(7)
    context = new_context(system_of(force), random_positions())
    assert energy_of(context, {7}) > 1 and energy_of(context, {0}) == 0


@ON_COMPILED_PLATFORMS
def test_links_of_contexts(platform):
    force = LinkForce()
    force.addLink(0, -1, 0, 1, -1, 0, HARMONIC, 0.4, 30.0, 0.0)
    system, positions = system_of(force), random_positions()
    first, second = (new_context(system, positions, platform=platform) for _ in range(2))
    parameter = force.getDigestParameter(first)
    assert parameter == "CylinderChainLinks0"
    digests = {first.getParameter(parameter)}
    untouched = energy_of(second)

    def check(numbers):
        assert force.getLinksInContext(first)[0] == tuple(numbers)
        digest = first.getParameter(parameter)
        assert digest == int(digest) and digest < 2**52 and digest not in digests
        digests.add(digest)
        expected = LinkForce()
        links = [list(column) for column in force.getLinksInContext(first)[:-1]]
        expected.setLinks(*links, force.getNextLinkNumberInContext(first))
        other = new_context(system_of(expected), positions, platform=platform)
        assert forces_of(first) == pytest.approx(forces_of(other), rel=1e-12, abs=1e-9)
        assert energy_of(first) == pytest.approx(energy_of(other), rel=1e-12)

    assert force.addLinkInContext(first, 0, 1, 0.25, 2, 3, 0.5, FENE, 0.4, 30.0, 12.0) == 1
    check([0, 1])
    assert force.addLinkToPointInContext(first, 5, -1, 0, openmm.Vec3(*POINT), HARMONIC, 0.0, 10.0, 0.0) == 2
    check([0, 1, 2])
    added = force.addLinksInContext(
        first, [1, -1, 4, -1, 2, 3, -1, -1], [0, 0, 0.5, 0], [0, 0, 0, 1, 2, 3], [0, 1], [0.1, 2, 0, 0.2, 3, 15]
    )
    assert added == 3
    check([0, 1, 2, 3, 4])
    before = energy_of(first)
    force.setLinksActiveInContext(first, [4, 0], False)
    check([0, 1, 2, 3, 4])
    assert energy_of(first) < before - 1 and force.getLinksInContext(first)[6] == (0, 1, 1, 1, 0)
    force.removeLinksInContext(first, [4, 1])
    check([0, 2, 3])
    force.setLinksActiveInContext(first, [0], True)
    check([0, 2, 3])
    force.setLinkParametersInContext(first, [3, 0], [FENE, HARMONIC], [0.5, 6.0, 14.0, 1.5, 7.0, 0.0])
    check([0, 2, 3])
    assert force.getLinksInContext(first)[5] == (1.5, 7.0, 0.0, 0.0, 10.0, 0.0, 0.5, 6.0, 14.0)
    # Numbers do not come again.
    assert force.addLinkInContext(first, 0, -1, 0, 2, -1, 0, HARMONIC, 0.4, 30.0, 0.0) == 5
    check([0, 2, 3, 5])
    force.setLinksInContext(first, [7], [0, -1, 1, -1], [0, 0], [], [0], [0, 1, 0], [1], 9)
    check([7])
    assert force.getNextLinkNumberInContext(first) == 9
    # Neither the other Context nor the Force has changed.
    assert force.getLinkNumbers() == (0,)
    assert force.getLinksInContext(second)[0] == (0,) and energy_of(second) == untouched
    # A Context that is made anew begins with the links of the Force, and keeps its State if it shall.
    first.reinitialize(preserveState=False)
    assert force.getLinksInContext(first)[0] == (0,)


def test_several_forces_have_parameters_of_their_own():
    system, forces = system_of(LinkForce()), [LinkForce(), LinkForce()]
    for force in forces:
        system.addForce(force)
    context = new_context(system, random_positions())
    assert [force.getDigestParameter(context) for force in forces] == ["CylinderChainLinks1", "CylinderChainLinks2"]
    forces[1].addLinkInContext(context, 0, -1, 0, 1, -1, 0, HARMONIC, 0, 1, 0)
    assert len(forces[0].getLinksInContext(context)[0]) == 0 and len(forces[1].getLinksInContext(context)[0]) == 1
    state = context.getState(parameters=True)
    forces[0].addLinkInContext(context, 0, -1, 0, 2, -1, 0, HARMONIC, 0, 1, 0)
    context.setState(state)
    assert len(forces[0].getLinksInContext(context)[0]) == 0 and len(forces[1].getLinksInContext(context)[0]) == 1


def test_going_back_in_a_context():
    force = all_kinds()
    system, positions = system_of(force), random_positions()
    context = new_context(system, positions)
    states, energies = [], []
    for change in range(300):
        states.append((context.getState(parameters=True), context.createCheckpoint()))
        energies.append(energy_of(context))
        number = force.addLinkInContext(context, 0, -1, 0, 1 + change % 7, -1, 0, HARMONIC, 0.1, 1 + change, 0.0)
        if change % 3 == 1:
            force.removeLinksInContext(context, [number])
        if change % 3 == 2:
            force.setLinksActiveInContext(context, [number], False)
            force.setLinkParametersInContext(context, [0], [0], [0.1, change, 0.0])
    assert len(set(energies)) > 150
    # Those of more than 256 changes ago are gone, except that of the System.
    for index in (299, 250, 299, 260, 298):
        context.setState(states[index][0])
        assert energy_of(context) == energies[index]
        context.loadCheckpoint(states[index][1])
        assert energy_of(context) == energies[index]
        assert force.getNextLinkNumberInContext(context) == 10 + index
    context.setState(states[5][0])
    message = "links of this Context are not known.*more than 256 changes ago.*setLinksInContext"
    with pytest.raises(openmm.OpenMMException, match=message):
        energy_of(context)
    for method in (force.getLinksInContext, force.getNextLinkNumberInContext):
        with pytest.raises(plugin.CylinderChainException, match=message) as caught:
            method(context)
        assert caught.value.kind == "unknown-links"
    with pytest.raises(openmm.OpenMMException, match=message):
        force.removeLinksInContext(context, [0])
    context.setState(states[0][0])
    assert energy_of(context) == energies[0]
    context.setState(states[5][0])
    force.setLinksInContext(context, *force.getLinks())
    assert energy_of(context) == energies[0]


def test_states_of_other_contexts():
    force = all_kinds()
    system, positions = system_of(force), random_positions()
    first, second = (new_context(system, positions) for _ in range(2))
    begin = first.getState(parameters=True, positions=True)
    force.removeLinksInContext(first, [0])
    state, links, energy = first.getState(parameters=True), force.getLinksInContext(first), energy_of(first)
    second.setState(state)
    with pytest.raises(openmm.OpenMMException, match="links of this Context are not known"):
        second.getIntegrator().step(1)
    force.setLinksInContext(second, *links)
    assert energy_of(second) == energy
    second.setState(state)
    assert energy_of(second) == energy
    second.setState(begin)
    assert force.getLinksInContext(second) == force.getLinks()


def filaments_with_links():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for y in (0, 50):
        filaments.add_straight(F_ACTIN, 4, [0, y, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    forces = LinkForce(), LinkForce()
    forces[0].addLink(1, 2, 0.5, 6, 7, 0.25, HARMONIC, 10.0, 0.01, 0.0)
    forces[1].addLinkToPoint(0, -1, 0.0, openmm.Vec3(0, -20, 0), FENE, 1.0, 0.01, 900.0)
    for force in forces:
        system.addForce(force)
    integrator = filaments.create_integrator(system, 1e4, scheme="midpoint", random_seed=3)
    return new_context(system, positions, integrator), forces, integrator


RESTART = """
import numpy as np
import openmm
from couplings.test_native_links import filaments_with_links, positions_of
for kind in ("checkpoint", "state"):
    context, forces, integrator = filaments_with_links()
    if kind == "checkpoint":
        context.loadCheckpoint(open("links.chk", "rb").read())
    else:
        context.setState(openmm.XmlSerializer.deserialize(open("links.xml").read()))
    print(forces[0].addLinkInContext(context, 3, 4, 0.5, 8, -1, 0.0, 0, 0.0, 0.02, 0.0))
    integrator.step(10)
    np.save(kind + ".npy", positions_of(context))
"""


def test_restarts_with_the_integrator_of_the_plugin(tmp_path):
    context, forces, integrator = filaments_with_links()
    begin = energy_of(context)
    integrator.step(10)
    forces[0].addLinkInContext(context, 0, -1, 0, 5, -1, 0, HARMONIC, 0.0, 0.01, 0.0)
    forces[0].setLinksActiveInContext(context, [0], False)
    forces[1].removeLinksInContext(context, [0])
    integrator.step(10)
    links = [force.getLinksInContext(context) for force in forces]
    (tmp_path / "links.chk").write_bytes(context.createCheckpoint())
    state = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
    (tmp_path / "links.xml").write_text(openmm.XmlSerializer.serialize(state))
    energy = energy_of(context)
    assert energy != begin
    assert forces[0].addLinkInContext(context, 3, 4, 0.5, 8, -1, 0.0, 0, 0.0, 0.02, 0.0) == 2
    integrator.step(10)
    expected = positions_of(context)
    for restore in (
        lambda other: other.loadCheckpoint((tmp_path / "links.chk").read_bytes()),
        lambda other: other.setState(openmm.XmlSerializer.deserialize((tmp_path / "links.xml").read_text())),
        lambda other: other.setState(state),
    ):
        other, others, _ = filaments_with_links()
        restore(other)
        assert [force.getLinksInContext(other) for force in others] == links and energy_of(other) == energy
    process = subprocess.run(
        [sys.executable, "-c", RESTART],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(TESTS)},
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    assert process.stdout.split()[-2:] == ["2", "2"]
    for kind in ("checkpoint", "state"):
        assert np.array_equal(np.load(tmp_path / f"{kind}.npy"), expected)
    # A System with another number of such forces cannot take them; one that is cut off is refused, too.
    less = context.getSystem()
    less = openmm.XmlSerializer.clone(less)
    less.removeForce(less.getNumForces() - 1)
    other = new_context(less, expected, openmm.XmlSerializer.clone(integrator))
    for restore in (
        lambda: other.loadCheckpoint((tmp_path / "links.chk").read_bytes()),
        lambda: (
            plugin.CylinderChainIntegrator.cast(other.getIntegrator()) and other.setState(without_parameters(state))
        ),
    ):
        with pytest.raises(openmm.OpenMMException, match="links of 2 Forces, but the System has 1"):
            restore()
    with pytest.raises(openmm.OpenMMException, match="ends within the state of a Force"):
        context.loadCheckpoint((tmp_path / "links.chk").read_bytes()[:-20])


def test_contexts_that_are_reinitialized():
    context, forces, integrator = filaments_with_links()
    forces[0].addLinkInContext(context, 0, -1, 0, 5, -1, 0, HARMONIC, 0.0, 0.01, 0.0)
    links, energy = forces[0].getLinksInContext(context), energy_of(context)
    context.reinitialize(preserveState=True)
    assert forces[0].getLinksInContext(context) == links and energy_of(context) == energy
    # Other integrators do not keep links.
    other = new_context(context.getSystem(), positions_of(context))
    forces[0].setLinksInContext(other, *links)
    other.reinitialize(preserveState=True)
    with pytest.raises(openmm.OpenMMException, match="links of this Context are not known: it was reinitialized"):
        energy_of(other)
    forces[0].setLinksInContext(other, *links)
    assert energy_of(other) == energy


def without_parameters(state):
    """A State that has only what is the integrator's."""
    xml = openmm.XmlSerializer.serialize(state)
    return openmm.XmlSerializer.deserialize(xml[: xml.index("<Parameters")] + xml[xml.index("<IntegratorParameters") :])


def test_lengths_out_of_range_are_named():
    context, forces, integrator = filaments_with_links()
    number = forces[1].addLinkInContext(context, 1, 2, 0.5, 8, -1, 0.0, FENE, 1.0, 1.0, 10.0)
    message = (
        r"Link 1 between the place 0.5 from particle 1 to 2 and particle 8 has blown up: its length of [0-9.]+ nm "
    )
    message += r"is outside 1 -/\+ 10 nm of the FENE potential"
    with pytest.raises(openmm.OpenMMException, match=message):
        energy_of(context)
    with pytest.raises(plugin.CylinderChainException, match=message) as caught:
        plugin.CylinderChainIntegrator.step(integrator, 1)
    assert caught.value.kind == "link-out-of-range" and caught.value.link == number
    forces[1].setLinksActiveInContext(context, [number], False)
    assert energy_of(context) < 1e6


@ON_COMPILED_PLATFORMS
def test_lengths_that_are_not_finite_are_named(platform):
    force = all_kinds(FENE)
    positions = random_positions()
    positions[7] = np.nan
    message = "between the place 1 from particle 5 to 6 and particle 7|^Particle coordinate is NaN"
    with pytest.raises(openmm.OpenMMException, match=message):
        energy_of(new_context(system_of(force), positions, platform=platform))


def test_bad_input_is_refused():
    good = (0, 1, 0.5, 2, -1, 0.0, HARMONIC, 0.5, 1.0, 0.0)
    nan, inf = float("nan"), float("inf")
    force = LinkForce()
    force.addLink(*good)
    system = system_of(force)
    context = new_context(system, random_positions())

    def changed(**values):
        names = ("first1", "second1", "fraction1", "first2", "second2", "fraction2", "model", "rest", "k", "extension")
        return tuple(values.get(name, value) for name, value in zip(names, good))

    for bad, message in (
        (changed(first1=-1, second1=-1), "Link 1 joins no particle with its first place"),
        (changed(first1=-2), "Link 1 has an illegal particle index: -2"),
        (changed(first1=-1), "illegal particle index: -1"),
        (changed(second1=-2), "illegal particle index: -2"),
        (changed(first2=-1), "Illegal particle index: -1"),
        (changed(second1=0), "Link 1 has a place between particle 0 and itself"),
        (changed(fraction1=1.01), "Link 1 has a fraction that is not between 0 and 1"),
        (changed(fraction1=-0.01), "fraction that is not between"),
        (changed(fraction1=nan), "fraction that is not between"),
        (changed(first2=0, second1=-1), "Link 1 joins a place to itself, between particles 0 and 0"),
        (changed(first2=1, second2=0, fraction2=0.5), "joins a place to itself, between the place 0.5 from particle 0"),
        (changed(fraction1=1.0, first2=1), "joins a place to itself"),
        (changed(model=2), "illegal stretching model: 2"),
        (changed(model=-1), "illegal stretching model: -1"),
        (changed(rest=-1.0), "rest length that is negative or not finite"),
        (changed(rest=nan), "rest length that is negative or not finite"),
        (changed(rest=inf), "rest length that is negative or not finite"),
        (changed(k=-1.0), "stiffness that is negative or not finite"),
        (changed(k=inf), "stiffness that is negative or not finite"),
        (changed(model=FENE), "maximum extension that is not positive and finite"),
        (changed(model=FENE, extension=nan), "maximum extension that is not positive and finite"),
        (changed(model=FENE, extension=inf), "maximum extension that is not positive and finite"),
    ):
        for add in (force.addLink, lambda *arguments: force.addLinkInContext(context, *arguments)):
            with pytest.raises(openmm.OpenMMException, match=message):
                add(*bad)
    with pytest.raises(openmm.OpenMMException, match="Link 1 has a point that is not finite"):
        force.addLinkToPoint(0, -1, 0, openmm.Vec3(0, nan, 0), HARMONIC, 0, 1, 0)
    for bad in (changed(first2=8), changed(second1=8), changed(second2=9, fraction2=0.5)):
        with pytest.raises(
            openmm.OpenMMException, match="Link 1 has particle [89], which does not exist; the System has 8"
        ):
            force.addLinkInContext(context, *bad)
        other = LinkForce()
        other.addLink(*bad)
        with pytest.raises(openmm.OpenMMException, match="Link 0 has particle [89], which does not exist"):
            new_context(system_of(other), random_positions())
    for numbers, message in (
        ([1], "Link 1 does not exist"),
        ([-1], "Link -1 does not exist"),
        ([0, 0], "0 is named twice"),
    ):
        for change in (
            lambda numbers: force.removeLinksInContext(context, numbers),
            lambda numbers: force.setLinksActiveInContext(context, numbers, False),
            lambda numbers: force.setLinkParametersInContext(
                context, numbers, [0] * len(numbers), [0.0] * 3 * len(numbers)
            ),
        ):
            with pytest.raises(openmm.OpenMMException, match=message):
                change(numbers)
    for columns, message in (
        (([0, 1], [0, 0], [], [0], [0, 1, 0]), "There must be 4 ends, but there are 2"),
        (([0, -1, 1, -1], [0], [], [0], [0, 1, 0]), "2 fractions, but there are 1"),
        (([0, -1, 1, -1], [0, 0], [1], [0], [0, 1, 0]), "3 coordinates of points, but there are 1"),
        (([0, -1, 1, -1], [0, 0], [], [0], [0, 1]), "3 parameters, but there are 2"),
        (([0, -1, -1, -1], [0, 0], [nan, 0, 0], [0], [0, 1, 0]), "a point that is not finite"),
    ):
        with pytest.raises(openmm.OpenMMException, match=message):
            force.addLinksInContext(context, *columns)
    row = [0, -1, 1, -1], [0, 0], [], [0], [0, 1, 0]
    for numbers, active, number, message in (
        ([-1], [1], 3, "must ascend from 0 on"),
        ([3], [1], 3, "next number must be above"),
        ([3], [], 4, "1 states of being on or off, but there are 0"),
        ([3, 4], [1], 5, "1 numbers, but there are 2"),
    ):
        with pytest.raises(openmm.OpenMMException, match=message):
            force.setLinksInContext(context, numbers, *row, active, number)
    for kind in (TypeError, OverflowError):
        with pytest.raises(kind):
            force.removeLinksInContext(context, ["a"] if kind is TypeError else [2**40])
    with pytest.raises(TypeError):
        force.removeLinksInContext(context, 3)
    # Nothing of this has changed anything.
    assert force.getLinksInContext(context)[0] == force.getLinkNumbers() == (0,)
    assert force.getNextLinkNumber() == force.getNextLinkNumberInContext(context) == 1
    with pytest.raises(openmm.OpenMMException):
        all_kinds().getLinksInContext(context)
