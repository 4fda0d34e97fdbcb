"""Filaments with twist: what they are given, their equilibrium at any step, linking numbers, and what is refused."""

import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.linalg import eigh

from openmm_cylchain import (
    F_ACTIN,
    Crosslinks,
    Filaments,
    FilamentType,
    InputError,
    InstabilityError,
    TwistWarning,
    analysis,
    check_time_step,
    theory,
)
from openmm_cylchain.engines.compiled import CylinderChainForce
from openmm_cylchain.mechanics.material_frames import material_vectors
from openmm_cylchain.units.quantities import BOLTZMANN
from support.contexts import new_context, positions_of
from support.ring_monte_carlo import RingMonteCarlo, regular_rings
from support.solvent import KT, TEMPERATURE, VISCOSITY
from support.supercoil_monte_carlo import SupercoiledRing, writhes_of_polygons
from support.twisted_chains import (
    CHAIN,
    DNA,
    LENGTH,
    NANOSECOND,
    SIGMAS,
    UNTWISTED,
    assert_near,
    in_context,
    mean_and_error,
    mean_square_angle_of_an_end,
    squares_of_end_angles,
)

# Of B-DNA, with 10.5 base pairs of 0.34 nm in a turn.
INTRINSIC = 2 * np.pi / 3.57
HELIX = replace(DNA, intrinsic_twist=INTRINSIC)


def held_chains(chains, segments, torque=None, kind=DNA):
    """Filaments along z, clamped at their minus ends, whose plus ends are held or have a torque."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(chains):
        filaments.add_straight(kind, segments, [100.0 * number, 0, 0], [0, 0, 1], clamped=[0, 1])
        if kind is not UNTWISTED:
            filaments.add_end_frame(number, "minus", [0, 0, 2.0])
            filaments.add_end_frame(number, "plus", [0, 0, 1.0], torque=torque)
    return filaments


# What is given


def test_rigidity_is_given_with_units_or_as_a_length():
    one = FilamentType(torsional_rigidity=250.0, **CHAIN)
    assert FilamentType(torsional_rigidity=250.0 * unit.kilojoule_per_mole * unit.nanometer, **CHAIN) == one
    of_length = FilamentType(twist_persistence_length=10 * unit.angstrom, temperature=TEMPERATURE, **CHAIN)
    assert of_length.torsional_rigidity == pytest.approx(KT) and of_length.twist_persistence_length is None
    assert one.twist_stiffness == 50.0
    assert one.with_segment_length(10.0).twist_stiffness == 25.0
    viscosity = 602.214
    assert one.axial_friction(viscosity) == pytest.approx(4 * np.pi * viscosity * 1.0**2 * LENGTH)
    assert one.axial_friction(1e-3 * unit.pascal * unit.second) == pytest.approx(one.axial_friction(viscosity))


def test_intrinsic_twist_is_given_with_units_and_kept_by_contour():
    degrees = FilamentType(torsional_rigidity=1.0, intrinsic_twist=-36 * unit.degree / unit.angstrom, **CHAIN)
    assert degrees.intrinsic_twist == pytest.approx(-2 * np.pi)
    assert degrees.rest_twist == pytest.approx(-2 * np.pi * LENGTH)
    assert degrees.with_segment_length(10.0).rest_twist == pytest.approx(-20 * np.pi)
    assert DNA.rest_twist == 0.0
    kind = replace(HELIX, stretching_modulus=1100 * unit.piconewton, temperature=TEMPERATURE)
    calibrated = theory.calibrated_up_to_force(kind, 5 * unit.piconewton, TEMPERATURE)
    assert calibrated.segment_length != LENGTH and calibrated.rest_twist == HELIX.rest_twist
    whole = theory.chain_mean_turn_cosine(HELIX, 3, TEMPERATURE)
    assert whole == pytest.approx(np.cos(15 * INTRINSIC) * theory.chain_mean_turn_cosine(DNA, 3, TEMPERATURE))


@pytest.mark.parametrize(
    ("own", "message"),
    [
        ({"torsional_rigidity": 0.0}, "torsional_rigidity"),
        ({"torsional_rigidity": -1.0}, "torsional_rigidity"),
        ({"torsional_rigidity": np.nan}, "torsional_rigidity"),
        ({"torsional_rigidity": 1.0 * unit.nanometer}, "torsional_rigidity"),
        ({"twist_persistence_length": 50.0}, "temperature"),
        ({"twist_persistence_length": -1.0, "temperature": 300.0}, "twist_persistence_length"),
        ({"twist_persistence_length": 50.0, "torsional_rigidity": 1.0, "temperature": 300.0}, "either"),
        ({"intrinsic_twist": 1.8}, "intrinsic_twist needs a torsional_rigidity"),
        ({"intrinsic_twist": np.nan, "torsional_rigidity": 1.0}, "intrinsic_twist"),
        ({"intrinsic_twist": 1.8 * unit.radian, "torsional_rigidity": 1.0}, "intrinsic_twist"),
    ],
)
def test_bad_rigidities_are_refused(own, message):
    with pytest.raises(InputError, match=message):
        FilamentType(**CHAIN, **own)


def test_what_has_no_twist_is_refused():
    with pytest.raises(InputError, match="no twist"):
        _ = UNTWISTED.twist_stiffness
    with pytest.raises(InputError, match="straight segments"):
        FilamentType(torsional_rigidity=1.0, element="beam", **{**CHAIN, "bending_model": "inscribed-circle"})
    with pytest.raises(InputError, match="portable engine has no twist"):
        Filaments(VISCOSITY, TEMPERATURE, engine="portable").add_straight(DNA, 4, [0, 0, 0], [0, 0, 1])
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    with pytest.raises(InputError, match="planar, and cannot have twist"):
        filaments.add_straight(DNA, 4, [0, 0, 0], [1, 0, 0], planar=True)
    filaments.add_straight(UNTWISTED, 4, [0, 0, 0], [0, 0, 1])
    with pytest.raises(InputError, match="has no twist"):
        filaments.add_end_frame(0, "minus", [0, 0, 1])


def test_bad_frames_are_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(DNA, 4, [0, 0, 0], [0, 0, 1])
    filaments.add_ring(DNA, 12, [50, 0, 0])
    for arguments, message in (
        ((1, "minus", [0, 0, 1]), "ring"),
        ((2, "minus", [0, 0, 1]), "2"),
        ((0, "left", [0, 0, 1]), "end"),
        ((0, "minus", [0, 0, 0]), "zero vector"),
        ((0, "minus", [0, 0, np.nan]), "direction"),
    ):
        with pytest.raises(InputError, match=message):
            filaments.add_end_frame(*arguments)
    for options, message in (
        ({"torque": np.nan}, "torque"),
        ({"torque": 1.0 * unit.nanometer}, "torque"),
        ({"angular_velocity": np.inf}, "angular_velocity"),
        ({"torque": 1.0, "angular_velocity": 1.0}, "that is held"),
    ):
        with pytest.raises(InputError, match=message):
            filaments.add_end_frame(0, "plus", [0, 0, 1], **options)
    filaments.add_end_frame(0, "plus", [0, 0, 1], torque=8 * unit.piconewton * unit.nanometer)
    assert filaments.end_frames[0].torque == pytest.approx(8 * 0.602214076)
    with pytest.raises(InputError, match="already"):
        filaments.add_end_frame(0, "plus", [0, 0, 1])


def test_other_schemes_and_integrators_are_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(DNA, 4, [0, 0, 0], [0, 0, 1])
    _, system, positions = filaments.build()
    for scheme in ("implicit-second-order", "midpoint", "euler"):
        with pytest.raises(InputError, match="twist"):
            filaments.create_integrator(system, 1.0, scheme=scheme)
    context = new_context(system, positions, openmm.LangevinMiddleIntegrator(300.0, 1.0, 1e-6))
    with pytest.raises(openmm.OpenMMException, match="twist"):
        context.getIntegrator().step(1)


def test_twists_are_asked_for_and_set():
    filaments = held_chains(1, 4)
    filaments.add_straight(UNTWISTED, 4, [50, 0, 0], [0, 0, 1])
    filaments.add_ring(DNA, 12, [150, 0, 0])
    filaments.add_straight(DNA, 4, [50, 50, 0], [0, 0, 1])
    filaments.add_end_frame(3, "plus", [0, 0, 1])
    _, own = in_context(filaments, NANOSECOND)
    assert own.twists(0).unit == unit.radian and own.twists(0)._value.tolist() == [0.0] * 5
    assert own.twists(2)._value.shape == (12,)
    own.set_twists(2, np.full(12, 30.0) * unit.degree)
    assert own.twists(2)._value == pytest.approx(np.full(12, np.pi / 6))
    own.turn_end(0, "plus", 90 * unit.degree)
    own.turn_end(0, "minus", -0.25)
    assert own.twists(0)._value == pytest.approx([0.25, 0, 0, 0, np.pi / 2])
    for function, arguments in (
        (own.twists, (1,)),
        (own.linking_number, (3,)),
        (own.twists, (4,)),
        (own.set_twists, (2, [1.0])),
        (own.set_twists, (2, [np.nan] * 12)),
        (own.linking_number, (1,)),
        (own.linking_number, (4,)),
        (own.turn_end, (2, "plus", 1.0)),
        (own.turn_end, (0, "plus", np.nan)),
        (own.turn_end, (0, "left", 1.0)),
        (own.record_tensions, ()),
        (own.joint_tensions, ()),
    ):
        with pytest.raises(InputError):
            function(*arguments)


def test_force_survives_xml():
    filaments = held_chains(2, 4, torque=1.5, kind=HELIX)
    _, system, _ = filaments.build()
    copy = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    force, original = (
        next(CylinderChainForce.cast(own) for own in one.getForces() if CylinderChainForce.isinstance(own))
        for one in (copy, system)
    )
    assert force.getChainTwist(1) == original.getChainTwist(1)
    assert force.getChainTwist(1)[1] == (HELIX.rest_twist,) * 3
    for end in (0, 1):
        assert str(force.getEndFrame(1, end)) == str(original.getEndFrame(1, end))


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_checkpoint_goes_on_to_the_bit(platform):
    """And so do a State with integratorParameters, and a Context of another System."""

    def chains_and_a_ring():
        filaments = held_chains(3, 12)
        filaments.add_ring(HELIX, 12, [500, 0, 0])
        return in_context(filaments, 100 * NANOSECOND, pull=KT, platform=platform)

    (context, own), *others = [chains_and_a_ring() for _ in range(4)]
    context.getIntegrator().step(37)
    others[0][0].loadCheckpoint(context.createCheckpoint())
    others[1][0].setState(context.getState(positions=True, integratorParameters=True))
    others[2][1].go_on_from(context)
    context.getIntegrator().step(21)
    for other, of_other in others:
        assert of_other.twists(3)._value.any()
        other.getIntegrator().step(21)
        assert np.array_equal(positions_of(context), positions_of(other))
        for number in range(4):
            assert np.array_equal(own.twists(number)._value, of_other.twists(number)._value)


def test_steps_taken_alone_are_those_taken_together():
    """One call of ``step`` for each, and one for all of them."""
    ends = []
    for calls in (1, 40):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        filaments.add_straight(DNA, 12, [0, 0, 0], [0, 0, 1])
        context, own = in_context(filaments, 10 * NANOSECOND)
        for _ in range(calls):
            context.getIntegrator().step(40 // calls)
        ends.append((positions_of(context), own.twists(0)._value))
    assert np.array_equal(ends[0][0], ends[1][0]) and np.array_equal(ends[0][1], ends[1][1])


def test_chains_of_other_lengths_share_lanes():
    """Of the processor's registers, to whom the longest decides: each moves as beside chains that are too short."""

    def after_steps(lengths):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        for number, segments in enumerate(lengths):
            clamped = [] if number == 2 else [0, 1]
            filaments.add_straight(DNA, segments, [300.0 * number, 0, 0], [0, 0, 1], clamped=clamped)
            for end in ("minus", "plus") if number < 2 or number == 4 else ("minus",) if number == 3 else ():
                torque = 2 * KT if (number, end) == (1, "plus") else None
                speed = 1e-5 if (number, end) == (4, "plus") else 0.0
                filaments.add_end_frame(number, end, [0, 0, 1], torque=torque, angular_velocity=speed)
        context, own = in_context(filaments, 50 * NANOSECOND, pull=KT)
        context.getIntegrator().step(6)
        positions = positions_of(context)
        return [(positions[nodes], own.twists(n)._value) for n, nodes in enumerate(filaments.node_indices)]

    lengths = np.array([20, 19, 19, 18, 18])
    together = after_steps(lengths)
    for number, (nodes, twists) in enumerate(together):
        alone = after_steps(np.where(np.arange(5) == number, lengths, 4))[number]
        assert nodes == pytest.approx(alone[0], abs=1e-9) and twists == pytest.approx(alone[1], abs=1e-9)


def test_segments_that_torque_has_folded_are_told_of():
    for kind, told in ((DNA, True), (UNTWISTED, False)):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        filaments.add_straight(kind, 4, [0, 0, 0], [0, 0, 1])
        context, _ = in_context(filaments, NANOSECOND)
        context.setPositions(positions_of(context)[[0, 1, 2, 1, 2]] * [1, 1, 1e3])
        with pytest.raises(InstabilityError, match="has blown up") as raised:
            context.getIntegrator().step(1)
        assert ("fewer excluded_neighbors, or less torque" in str(raised.value)) == told


@pytest.mark.parametrize(("share", "warned"), [(0.98, False), (1.02, True)])
def test_torque_that_winds_without_end_is_warned_of(share, warned):
    """Not where the other end turns freely, or what pulls is not known."""
    pull, torque = 2.0 * KT, share * theory.critical_torque(DNA, 2.0 * KT)
    caught = []
    for ends, energy in ((("minus", "plus"), "-pull*z"), (("plus",), "-pull*z"), (("minus", "plus"), "-pull*z^3")):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        filaments.add_straight(DNA, 20, [0, 0, 0], [0, 0, 1], clamped=[0, 1])
        for end in ends:
            filaments.add_end_frame(0, end, [0, 0, 1], torque=-torque if end == "plus" else None)
        _, system, _ = filaments.build()
        force = openmm.CustomExternalForce(energy)
        force.addPerParticleParameter("pull")
        for node, own in ((-1, 4.0 * pull), (-2, -3.0 * pull)):
            force.addParticle(int(filaments.node_indices[0][node]), [own])
        system.addForce(force)
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always", TwistWarning)
            filaments.create_integrator(system, NANOSECOND)
        caught.append([str(one.message) for one in found if issubclass(one.category, TwistWarning)])
    assert caught[1:] == [[], []] and len(caught[0]) == warned
    assert not warned or "8.56 pN, filaments are straight up to" in caught[0][0]


def test_step_is_checked():
    """Of free chains and of rings that begin, in each window, with the turns that they have."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(8):
        filaments.add_equilibrium(HELIX, 8, number)
    rings = [filaments.add_ring(HELIX, 16, [200.0 * number, 0, 0]) for number in range(2)]
    _, system, positions = filaments.build()
    twists = {ring: np.full(16, HELIX.rest_twist + np.pi / 16) for ring in rings}
    check = check_time_step(filaments, system, positions, NANOSECOND, frames=48, twists=twists)
    free, closed = check["DNA x 8 twist, mean square"], check["DNA x 16 twist, mean square"]
    assert check["DNA x 8 twist energy"].values == pytest.approx((0.5, 0.5), rel=0.25)
    # Some of the half turn of rings is writhe.
    assert closed.verdict == "right" and all(0.5 < value / np.pi**2 < 1.0 for value in closed.values)
    # Both runs follow one path.
    assert free.unpaired_standard_error > 2 * free.standard_error
    filaments = held_chains(2, 4)
    filaments.add_straight(DNA, 4, [300, 0, 0], [0, 0, 1])
    _, system, positions = filaments.build()
    check = check_time_step(filaments, system, positions, NANOSECOND, frames=2)
    assert {one.name for one in check.observables if "twist, " in one.name} == {
        "DNA x 4 twist, mean square",
        "DNA x 4 (filament 2) twist, mean square",
    }
    for wrong, message in (([1.0], "twists"), ({0: np.zeros(4)}, "shape"), ({3: np.zeros(5)}, "does not exist")):
        with pytest.raises(InputError, match=message):
            check_time_step(filaments, system, positions, NANOSECOND, frames=2, twists=wrong)


# Linking numbers


@pytest.mark.parametrize("contacts", [False, True])
def test_linking_number_of_rings_is_followed(contacts):
    """The sum of twist and writhe stays what it was, in networks as well."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(3):
        filaments.add_ring(DNA, 24, [120.0 * number, 0, 0])
    context, own = in_context(filaments, 20 * NANOSECOND, contacts=contacts)
    for number in range(3):
        own.set_twists(number, np.full(24, np.pi * number / 24))
    for _ in range(60):
        context.getIntegrator().step(3)
        for number in range(3):
            assert own.linking_number(number) == pytest.approx(0.5 * number, abs=1e-10)


@pytest.mark.parametrize(("precision", "contacts"), [("double", False), ("mixed", False), ("mixed", True)])
def test_linking_number_of_a_held_chain_is_followed(precision, contacts):
    """With its ends joined far away, by a polygon in a plane beside them."""
    filaments = held_chains(1, 16)
    context, own = in_context(filaments, 100 * NANOSECOND, pull=2 * KT, contacts=contacts, precision=precision)
    own.turn_end(0, "plus", 2 * np.pi)
    turns = []
    for _ in range(40):
        context.getIntegrator().step(250 if precision == "mixed" else 3)
        assert context.getIntegrator().getNumMixedPrecisionChains() == (precision == "mixed")
        nodes = positions_of(context)
        first, last = nodes[0], nodes[-1]
        far = 1e6
        around = [last + [0, 0, far], [far, 0, far], [far, 0, -far], first - [0, 0, far]]
        turns.append(own.twists(0)._value.sum() / (2 * np.pi) + analysis.writhe(np.concatenate([nodes, around])))
        assert own.linking_number(0) == pytest.approx(1.0, abs=2e-3)
    assert turns == pytest.approx([1.0] * 40, abs=1e-4)


def test_frames_turn():
    """At a given speed: that of the straight chain, all of whose joints share the turns."""
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_straight(DNA, 8, [0, 0, 0], [0, 0, 1], clamped=[0, 1])
    filaments.add_end_frame(0, "minus", [0, 0, 1])
    filaments.add_end_frame(0, "plus", [0, 0, 1], angular_velocity=1e-7)
    context, own = in_context(filaments, 1e5, pull=KT)
    context.getIntegrator().step(40)
    twists = own.twists(0)._value
    assert twists.sum() == pytest.approx(40 * 1e5 * 1e-7)
    # Friction lets the turns lag behind.
    assert twists == pytest.approx(0.4 / 8 * np.array([0.5, *[1] * 7, 0.5]), rel=0.1)
    assert positions_of(context)[:, :2] == pytest.approx(0.0, abs=1e-12)


# Intrinsic twist


def rings_and_chains(kind):
    """A ring with two turns more than at rest, a chain that is held in two, one with a torque, and a free one."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number, torque in enumerate((None, 2 * KT)):
        filaments.add_straight(kind, 12, [100.0 * number, 0, 0], [0, 0, 1], clamped=[0, 1])
        filaments.add_end_frame(number, "minus", [0, 0, 1])
        filaments.add_end_frame(number, "plus", [0, 0, 1], torque=torque)
    filaments.add_equilibrium(kind, 12, 1, start=[300, 0, 0])
    filaments.add_ring(kind, 24, [400, 0, 0])
    context, own = in_context(filaments, 10 * NANOSECOND, pull=KT)
    own.turn_end(0, "plus", 4 * np.pi)
    own.set_twists(3, own.twists(3)._value + 4 * np.pi / 24)
    return filaments, context, own


def test_intrinsic_twist_is_what_twists_are_counted_from():
    """Chains move as those without, and the torque of a ring with Lk0 + 2 turns is that of one with 2."""
    filaments, context, own = rings_and_chains(HELIX)
    _, plain, of_plain = rings_and_chains(DNA)
    relaxed = 24 * LENGTH * INTRINSIC
    for _ in range(8):
        for one in (context, plain):
            one.getIntegrator().step(5)
        # Rounding grows as paths part.
        assert positions_of(context) == pytest.approx(positions_of(plain), abs=1e-6)
        for number in range(4):
            rest = HELIX.rest_twist * (np.ones(24) if number == 3 else np.array([0, *[1] * 11, 0]))
            assert own.twists(number)._value - rest == pytest.approx(of_plain.twists(number)._value, abs=1e-6)
        writhe = analysis.writhe(positions_of(context)[filaments.node_indices[3]])
        assert own.twists(3)._value.sum() + 2 * np.pi * writhe == pytest.approx(relaxed + 4 * np.pi, abs=1e-9)


def test_ring_without_noise_stays_at_its_intrinsic_twist():
    """A ring that begins has no torque: one with any whole Lk that is not N m0/2 pi has some."""
    filaments = Filaments(VISCOSITY, 0.0)
    for number in range(2):
        filaments.add_ring(HELIX, 24, [100.0 * number, 0, 0])
    context, own = in_context(filaments, 10 * NANOSECOND)
    own.set_twists(1, np.full(24, 2 * np.pi * round(24 * HELIX.rest_twist / (2 * np.pi)) / 24))
    context.getIntegrator().step(20)
    assert own.twists(0)._value == pytest.approx(np.full(24, HELIX.rest_twist))
    # 33.61 turns at rest, of 34 which are kept.
    torque = HELIX.twist_stiffness * (own.twists(1)._value - HELIX.rest_twist)
    assert torque == pytest.approx(np.full(24, 100 * KT * 2 * np.pi * (34 / 120 - 1 / 3.57)))


# Equilibrium


@pytest.mark.parametrize(("step", "precision"), [(1e2, "mixed"), (1e3, "mixed"), (1e4, "mixed"), (1e4, "double")])
def test_twist_of_free_chains(step, precision):
    """k_B T l0/C in each joint, independent of each other, at any step; bends are those of chains without."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(48):
        filaments.add_equilibrium(DNA, 8, number)
    context, own = in_context(filaments, step, precision=precision)
    variances, products, bends = [], [], []
    context.getIntegrator().step(int(max(20, 4e4 / step)))
    assert context.getIntegrator().getNumMixedPrecisionChains() == (48 if precision == "mixed" else 0)
    for _ in range(400):
        context.getIntegrator().step(int(max(2, 6e3 / step)))
        twists = np.array([own.twists(number)._value[1:-1] for number in range(48)])
        variances.append((twists**2).mean(axis=1))
        products.append((twists[:, 1:] * twists[:, :-1]).mean(axis=1))
        vectors = np.diff(positions_of(context)[np.array(filaments.node_indices)], axis=1)
        tangents = vectors / np.linalg.norm(vectors, axis=2)[..., None]
        bends.append(1 - (tangents[:, 1:] * tangents[:, :-1]).sum(axis=2).mean(axis=1))
    exact = theory.chain_twist_variance(DNA, TEMPERATURE)
    assert exact == pytest.approx(LENGTH / 100)
    assert_near(variances, exact)
    mean, error = mean_and_error(np.array(products))
    assert abs(mean) < SIGMAS * error and SIGMAS * error < 0.05 * exact
    assert_near(bends, 1 - theory.mean_joint_cosine(DNA, TEMPERATURE))


@pytest.mark.slow
@pytest.mark.parametrize("step", [1e2, 1e3, 1e4])
def test_material_frames_of_free_chains(step):
    """Of two, n joints apart, from a twelfth to eight times the recommended step.

    With the mean cosine c of a joint: c^n along; across, ((1 + c)/2)^n exp(-n l0/2C) and the angle n m0 of the helix,
    exp(-s (1/A + 1/C)/2) of short segments (Brackley, Morozov and Marenduzzo, J. Chem. Phys. 2014, 140, 135103).
    """
    generator = np.random.default_rng(1)
    # In short steps, what is drawn at the start hardly changes.
    segments, chains = 11, 4500 if step == 1e2 else 2560
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(chains):
        filaments.add_equilibrium(HELIX, segments, number)
    context, own = in_context(filaments, step)
    for number in range(chains):
        drawn = generator.normal(HELIX.rest_twist, np.sqrt(LENGTH / 100), segments - 1)
        own.set_twists(number, np.concatenate([[0], drawn, [0]]))
    nodes, samples = np.array(filaments.node_indices), {}
    for _ in range(8):
        context.getIntegrator().step(250)
        positions = positions_of(context)[nodes]
        along = np.diff(positions, axis=1)
        along /= np.linalg.norm(along, axis=2)[..., None]
        across = np.array([material_vectors(x, False, own.twists(n)._value, 0.0) for n, x in enumerate(positions)])
        third = np.cross(along, across)

        def mean_cosine(first, second, joints):
            return (first[:, :-joints] * second[:, joints:]).sum(axis=2).mean(axis=1)

        for joints in (2, 5, 10):
            cosine = mean_cosine(across, across, joints) + mean_cosine(third, third, joints)
            sine = mean_cosine(third, across, joints) - mean_cosine(across, third, joints)
            turned = 0.5 * (cosine + 1j * sine) * np.exp(-1j * joints * HELIX.rest_twist)
            own_samples = (mean_cosine(along, along, joints), turned.real, turned.imag)
            for name, values in zip(("along", "across", "beside"), own_samples):
                samples.setdefault((name, joints), []).append(values)
    bend = theory.mean_joint_cosine(HELIX, TEMPERATURE)
    for (name, joints), values in samples.items():
        mean, error = mean_and_error(np.array(values))
        twisted = (0.5 * (1 + bend)) ** joints * np.exp(-0.5 * joints * LENGTH / 100)
        exact = {"along": bend**joints, "across": twisted, "beside": 0.0}[name]
        # Bends are 0.8 % smaller in the longest steps.
        allowed = 0.001 * joints * exact if step == 1e4 else 0.0
        assert mean == pytest.approx(exact, abs=allowed + SIGMAS * error), (name, joints)
        # Along ten joints, directions are a third of what they were, and cannot be told.
        assert (name, joints) == ("along", 10) or SIGMAS * error < 0.03 * twisted, (name, joints)


@pytest.mark.parametrize("step", [1e3, 1e2, pytest.param(1e1, marks=pytest.mark.slow)])
def test_torsional_diffusion_of_ends(step):
    """Of free ends, in ten of the longest steps: between joints, which relax within 1.3 ns, and the whole, 33 ns.

    Chains are straight: bends turn ends by writhe as well.
    """
    segments, time = 16, 1e4
    exact = mean_square_angle_of_an_end(segments, time)
    long_chain = 4 * KT * np.sqrt(time / (np.pi * DNA.axial_friction(VISCOSITY) * DNA.twist_stiffness))
    assert 0.8 < exact / long_chain < 0.9
    assert_near(squares_of_end_angles(step, time, segments), exact)


def turned_by_writhe(own, filaments):
    """By how much ends with a torque have turned more than twist, over 2 pi the writhe, of each filament."""
    return [-own.twists(number)._value.sum() for number in range(len(filaments.node_indices))]


# Of Metropolis walks of the same chain with 64 inextensible segments, under 2 k_B T/nm with the last segment as here:
# 1 - z/L of the middle, without torque and with 10 k_B T, and what the chain turns by writhe under it.
SHORTENING, SHORTENING_UNDER_TORQUE, WRITHE = 0.04517, 0.05179, 0.724


@pytest.mark.slow
@pytest.mark.parametrize("step", [1e4, 1e5, 1e6])
@pytest.mark.parametrize("torque", [0.0, 10.0])
def test_chain_under_tension_and_torque(torque, step):
    """Extension, writhe and twist at any step over a factor of 100."""
    filaments = held_chains(16, 64, torque=torque * KT)
    context, own = in_context(filaments, step, pull=2 * KT)
    nodes = np.array(filaments.node_indices)
    context.getIntegrator().step(int(max(100, 1e8 / step)))
    shortenings, writhes, means, twists = [], [], [], []
    for _ in range(400):
        context.getIntegrator().step(int(max(4, 4e5 / step)))
        positions = positions_of(context)[nodes]
        lengths = np.linalg.norm(np.diff(positions, axis=1), axis=2)
        shortenings.append(1 - (positions[:, -4, 2] - positions[:, 4, 2]) / lengths[:, 4:-3].sum(axis=1))
        of_joints = np.array([own.twists(number)._value for number in range(16)])
        writhes.append(turned_by_writhe(own, filaments))
        means.append(of_joints[:, 1:-1].mean(axis=1))
        twists.append((of_joints[:, 1:-1] - torque * LENGTH / 100).std(axis=1) ** 2)
    mean, error = mean_and_error(np.array(shortenings))
    exact = SHORTENING_UNDER_TORQUE if torque else SHORTENING
    # Of the extension, 0.2 %: bends under tension are larger than they should be by 1 to 3 %, without twist as well.
    assert mean == pytest.approx(exact, abs=0.0018) and SIGMAS * error < 0.05 * exact
    # So that writhe is by 3 to 5 %.
    mean, error = mean_and_error(np.array(writhes))
    assert mean == pytest.approx(WRITHE if torque else 0.0, abs=0.05 * WRITHE + SIGMAS * error)
    assert SIGMAS * error < 0.1 * WRITHE
    mean, error = mean_and_error(np.array(means))
    assert mean == pytest.approx(torque * LENGTH / 100, abs=SIGMAS * error) and SIGMAS * error < 0.01
    assert_near(twists, LENGTH / 100 * 62 / 63)


@pytest.mark.slow
def test_writhe_in_the_recommended_step():
    """Under tension and torque: that of an eighth of the step, on the same Brownian path."""
    filaments = held_chains(16, 64, torque=10 * KT)
    context, own = in_context(filaments, 1e5, pull=2 * KT)
    step = filaments.recommended_time_step(system=context.getSystem()).step
    for settling in (1e5, step):
        context.getIntegrator().setStepSize(settling)
        context.getIntegrator().step(1000)
    positions, twists = positions_of(context), [own.twists(number)._value for number in range(16)]
    writhes = []
    for level in (0, 3):
        filaments = held_chains(16, 64, torque=10 * KT)
        context, own = in_context(filaments, step / 2**level, pull=2 * KT, seed=2, level=level)
        context.setPositions(positions)
        for number in range(16):
            own.set_twists(number, twists[number])
        samples = []
        for _ in range(100):
            context.getIntegrator().step(32 * 2**level)
            samples.append(turned_by_writhe(own, filaments))
        writhes.append(np.array(samples))
    change, error = mean_and_error(writhes[0] - writhes[1])
    assert abs(change) < 0.01 * writhes[1].mean() and SIGMAS * error < 0.01 * writhes[1].mean()


@pytest.mark.slow
def test_torque_of_chains_held_in_turns_is_that_of_the_closed_form():
    """C_eff, at a step that is a hundred times longer than another, and from the writhe of nearly straight chains."""
    turn, torques = 20.0, []
    for step, precision in ((1e4, "mixed"), (1e6, "mixed"), (1e6, "double")):
        filaments = held_chains(16, 64)
        context, own = in_context(filaments, step, pull=4 * KT, precision=precision)
        for number in range(16):
            own.set_twists(number, turn / 64 * np.array([0.5, *[1] * 63, 0.5]))
        context.getIntegrator().step(int(max(200, 1e8 / step)))
        samples = []
        for _ in range(300):
            context.getIntegrator().step(int(max(4, 4e5 / step)))
            samples.append([own.twists(number)._value[1:-1].mean() * 100 / LENGTH for number in range(16)])
        torques.append(mean_and_error(np.array(samples)))
    chain = theory.twisted_chain(DNA, 4 * KT, 0.0, TEMPERATURE)
    exact = chain.effective_torsional_rigidity / KT * turn / (64 * LENGTH)
    for mean, error in torques:
        assert error < 0.002 * exact
        assert mean == pytest.approx(exact, rel=0.01)
    assert torques[0][0] == pytest.approx(torques[1][0], abs=SIGMAS * np.hypot(torques[0][1], torques[1][1]) + 0.002)
    # On one path.
    assert torques[1] == pytest.approx(torques[2], rel=1e-3)


# Of 100 nm, so that they relax soon, and with so much twist that it divides the mean of Wr^2 by 2.5.
KIND_OF_RINGS = replace(DNA, torsional_rigidity=300.0 * KT).with_segment_length(10.0)
# The mean of Wr^2 where Lk = 0, and its standard error, by Monte Carlo.
SQUARE_OF_WRITHE = 0.0023455, 0.0000050


@pytest.mark.exhaustive
def test_square_of_writhe_is_that_of_monte_carlo():
    """Of rings without twist, with the weights exp(-2 pi^2 C Wr^2/k_B T L) of those with twist."""
    ring = SupercoiledRing(10, 10.0, 5.0, 400.0, 0.0, 0.0, 2, twist=30.0, turns=0.0)
    sampler = RingMonteCarlo(ring, regular_rings(ring, 1500), 2)
    sampler.sweep(1000)
    totals = 0.0
    for _ in range(100):
        sampler.sweep(30)
        squares = ring.writhes(sampler.nodes) ** 2
        weights = np.exp(-2 * np.pi**2 * ring.twist / ring.segments * squares)
        totals = totals + np.array([weights * squares, weights])
    mean = totals[0].sum() / totals[1].sum()
    error = (totals[0] - mean * totals[1]).std(ddof=1) / totals[1].mean() / np.sqrt(totals.shape[1])
    exact, exact_error = SQUARE_OF_WRITHE
    assert error < 0.01 * exact and mean == pytest.approx(exact, abs=SIGMAS * np.hypot(error, exact_error))


@pytest.mark.slow
def test_writhe_of_rings_is_that_of_monte_carlo():
    """In the recommended step, within 1 %. Lk is zero, so that the writhe is what twist leaves.

    Beside that, the twist of ten joints has nine values of its own.
    """
    rings, step = 256, 4e3
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(rings):
        filaments.add_ring(KIND_OF_RINGS, 10, [200.0 * number, 0, 0])
    context, own = in_context(filaments, 1e4)
    context.getIntegrator().step(2000)
    context.getIntegrator().setStepSize(step)
    squares, variances = [], []
    for _ in range(400):
        context.getIntegrator().step(25)
        twists = np.array([own.twists(number)._value for number in range(rings)])
        squares.append((twists.sum(axis=1) / (2 * np.pi)) ** 2)
        variances.append(twists.var(axis=1))
    exact, exact_error = SQUARE_OF_WRITHE
    mean, error = mean_and_error(np.array(squares))
    deviation = SIGMAS * np.hypot(error, exact_error)
    assert deviation < 0.035 * exact and mean == pytest.approx(exact, abs=0.01 * exact + deviation)
    assert_near(variances, 0.9 * 10 / 300, error=0.01)


@pytest.mark.slow
def test_twist_of_chains_that_are_closed_is_free():
    """By a link of their ends, which twist can pass: var Tw = k_B T L/4 pi^2 C, and var Lk = var Tw + var Wr.

    Their writhe is that of chains without twist.
    """
    segments, chains, squares = 16, 128, {}
    angles = 2 * np.pi * np.arange(segments + 1) / segments
    polygon = 0.5 * LENGTH / np.sin(np.pi / segments) * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    for kind in (DNA, UNTWISTED):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        links = Crosslinks(10 * KT, 0.0)
        for number in range(chains):
            filaments.add_nodes(kind, polygon + [200.0 * number, 0, 0])
            first = number * (segments + 1)
            links.add(None, first, first + segments)
        context, own = in_context(filaments, 1e4, links=links)
        context.getIntegrator().step(500)
        samples = []
        for _ in range(500):
            context.getIntegrator().step(10)
            writhes = writhes_of_polygons(positions_of(context)[np.array(filaments.node_indices)])
            twists = [own.twists(number)._value[1:-1].sum() if kind is DNA else 0.0 for number in range(chains)]
            samples.append([np.array(twists) / (2 * np.pi), writhes])
        twists, writhes = np.moveaxis(np.array(samples), 1, 0)
        squares[kind] = [one**2 for one in (twists, writhes, twists + writhes)]
    exact = (segments - 1) * LENGTH / 100 / (4 * np.pi**2)
    assert_near(squares[DNA][0], exact, error=0.03)
    mean, error = mean_and_error(squares[DNA][1])
    without, of_without = mean_and_error(squares[UNTWISTED][1])
    deviation = SIGMAS * np.hypot(error, of_without)
    assert deviation < 0.05 * without and mean == pytest.approx(without, abs=deviation)
    mean, error = mean_and_error(squares[DNA][2] - squares[DNA][1])
    assert SIGMAS * error < 0.12 * exact and mean == pytest.approx(exact, abs=SIGMAS * error)


@pytest.mark.slow
def test_writhe_of_rings_follows_from_that_of_rings_without_twist():
    """Lk is zero: each ring without twist has the weight exp(-2 pi^2 C Wr^2/k_B T L) there."""
    segments, rings, step = 30, 16, 1e5
    means = {}
    for kind in (UNTWISTED, DNA):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        for number in range(rings):
            filaments.add_ring(kind, segments, [200.0 * number, 0, 0])
        context, _ = in_context(filaments, step)
        context.getIntegrator().step(int(2e7 / step))
        squares = []
        for _ in range(700):
            context.getIntegrator().step(int(max(4, 4e5 / step)))
            positions = positions_of(context)
            squares.append([analysis.writhe(positions[nodes]) ** 2 for nodes in filaments.node_indices])
        means[kind] = np.array(squares)
    weights = np.exp(-2 * np.pi**2 * 100 / (segments * LENGTH) * means[UNTWISTED])
    weighted = (weights * means[UNTWISTED]).mean(axis=0), weights.mean(axis=0)
    expected = weighted[0].sum() / weighted[1].sum()
    left_out = [np.delete(weighted[0], i).sum() / np.delete(weighted[1], i).sum() for i in range(rings)]
    deviation = np.sqrt((rings - 1) * np.var(left_out))
    mean, error = mean_and_error(means[DNA])
    assert np.hypot(error, deviation) < 0.03 * expected
    assert mean == pytest.approx(expected, abs=SIGMAS * np.hypot(error, deviation))
    assert mean < 0.9 * means[UNTWISTED].mean()


# Instabilities without noise


def critical_share(growth):
    """Of a load, where growth, which is a function of the share, changes its sign: between 0.99 and 1.01."""
    shares = (0.99, 1.01)
    growths = [growth(share) for share in shares]
    assert growths[0] < 0.0 < growths[1]
    return np.interp(0.0, growths, shares)


def polygon_buckling_share(segments):
    """Turns at which a flat regular polygon buckles, over those of a circle.

    The torque T does work on the area that tangents go around on the sphere. With theta = 2 pi/segments, their
    longitudes n theta + psi and latitudes z, and those of the next one psi' and z', the energy is to second order the

        sum of K cos theta (psi' - psi)^2/2 + K (cos theta z^2 - z z') + T (z + z') (psi' - psi)/(2 cos^2(theta/2)).

    Waves of two periods around the ring are at rest where T = K sin theta cos(theta/2) (2 + 1/cos theta)^(1/2).
    """
    angle = 2 * np.pi / segments
    return np.sin(angle) / angle * np.cos(angle / 2) * np.sqrt((2 + 1 / np.cos(angle)) / 3)


@pytest.mark.parametrize("step", [2e3, 2e4, 2e5])
def test_ring_buckles_beyond_so_many_turns(step):
    """sqrt(3) A/C within 1 %, and those of its polygon within 0.01 %."""
    segments = 60

    def growth(share):
        generator = np.random.default_rng(1)
        filaments = Filaments(VISCOSITY / 100, 0.0)
        filaments.add_ring(DNA, segments, [0, 0, 0])
        context, own = in_context(filaments, step)
        context.setPositions(positions_of(context) + generator.normal(0.0, 1e-3, (segments, 3)))
        turns = share * theory.ring_buckling_turns(DNA)
        own.set_twists(0, np.full(segments, 2 * np.pi * turns / segments))
        heights = []
        # Other modes decay first.
        for time in (3e6, 4e6):
            context.getIntegrator().step(round(time / step))
            nodes = positions_of(context)
            heights.append(np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)[2])
        return np.log(heights[1] / heights[0])

    critical = critical_share(growth)
    assert critical == pytest.approx(polygon_buckling_share(segments), abs=1e-4)
    assert critical == pytest.approx(1.0, abs=0.01)


def column_growth(segments, torque, force, step, follows):
    """Of the first mode of a hinged column, which a force compresses and a torque twists, in thirty steps.

    Frames do not turn. A hinge shares the torque between the direction of its frame and that of its segment, as a joint
    of constant velocity does. Where the torque does not follow, a couple on both ends brings it to the axis.
    """
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_straight(DNA, segments, [0, 0, 0], [0, 0, 1], clamped=[0, segments])
    for end in ("minus", "plus"):
        filaments.add_end_frame(0, end, [0, 0, 1])
    couple = openmm.CustomExternalForce("-push_x*x - push_y*y")
    for name in ("push_x", "push_y"):
        couple.addPerParticleParameter(name)
    for node in (1, segments - 1):
        couple.addParticle(node, [0, 0])
    context, own = in_context(filaments, step, force=couple)
    nodes = np.arange(segments + 1)
    turn = np.arctan2(torque, 2 * DNA.bending_rigidity / LENGTH)
    start = 1e-4 * np.sin(np.pi * nodes / segments) * np.exp(1j * turn * nodes)
    compressed = LENGTH * (1 - force / DNA.stretching_modulus)
    context.setPositions(np.transpose([start.real, start.imag, compressed * nodes]))
    own.set_twists(0, torque / DNA.twist_stiffness * np.array([0.5, *[1] * (segments - 1), 0.5]))
    sizes = []
    for _ in range(60):
        x, y = positions_of(context)[:, :2].T
        sizes.append(np.hypot(x, y).max())
        if not follows:
            for number, (node, pull) in enumerate(((1, -torque), (segments - 1, torque))):
                turned = 0.5 * pull / LENGTH**2 * np.array([-y[node], x[node]])
                couple.setParticleParameters(number, node, turned)
            couple.updateParametersInContext(context)
        context.getIntegrator().step(1)
    return np.log(sizes[-1] / sizes[30])


def greenhill_force(segments, torque):
    """The compression at which a hinged column buckles that torques about its axis twist: its discrete chain.

    Waves exp(i kappa n) are at rest where 2 K (1 - cos kappa) = torque sin kappa + force l0; of two, whose kappa differ
    by 2 pi/segments, the difference vanishes at both ends.
    """
    stiffness = DNA.bending_rigidity / LENGTH
    return (2 * stiffness - np.cos(np.pi / segments) * np.hypot(2 * stiffness, torque)) / LENGTH


def semitangential_force(segments, torque):
    """The same where half of the torque follows each end, from the energy of bends, torque and compression."""
    stiffness = DNA.bending_rigidity / LENGTH
    slopes = np.diff(np.eye(segments + 1)[:, 1:-1], axis=0) / LENGTH
    bends = np.diff(slopes, axis=0)
    area = slopes[:-1].T @ slopes[1:]
    energy = stiffness * bends.T @ bends + 0.5j * torque * (area.T - area)
    return eigh(energy, LENGTH * slopes.T @ slopes, eigvals_only=True)[0]


@pytest.mark.parametrize("reduced_torque", [0.0, 2.0, 4.0])
@pytest.mark.parametrize("follows", [True, False])
def test_hinged_column_with_torque_buckles(follows, reduced_torque):
    """At torques of 2 and 4 A/L: growth changes its sign within 0.1 % of the force, Greenhill's on the axis."""
    segments = 20
    length = segments * LENGTH
    torque = reduced_torque * DNA.bending_rigidity / length
    critical = (semitangential_force if follows else greenhill_force)(segments, torque)
    euler = np.pi**2 * DNA.bending_rigidity / length**2
    if not follows:
        continuum = euler - torque**2 / (4 * DNA.bending_rigidity)
        assert critical == pytest.approx(continuum, rel=0.01)
    share = critical_share(lambda share: column_growth(segments, torque, share * critical, 1e6, follows))
    assert share == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("step", [2e2, 2e3, 2e4])
def test_straight_chain_is_unstable_beyond_a_torque(step):
    """Within 1 % of the torque of a long one under tension, and 0.1 % of the tension of one with hinged ends."""
    segments, pull = 100, 0.5 * KT
    torque = theory.critical_torque(DNA, pull)
    critical = critical_share(lambda share: column_growth(segments, share * torque, -pull, step, follows=False))
    assert critical == pytest.approx(1.0, abs=0.01)
    assert greenhill_force(segments, critical * torque) == pytest.approx(-pull, rel=1e-3)


# What is compared with


def test_writhe_and_linking_number():
    """Of a circle, a torus knot and its mirror image, and of two circles through each other."""
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert analysis.writhe(circle) == 0.0
    knot = np.stack(
        [np.sin(angle) + 2 * np.sin(2 * angle), np.cos(angle) - 2 * np.cos(2 * angle), np.sin(3 * angle)], axis=1
    )
    assert 3.2 < analysis.writhe(knot) < 3.5
    assert analysis.writhe(knot * [1, 1, -1]) == pytest.approx(-analysis.writhe(knot))
    assert analysis.writhe(knot * unit.angstrom) == pytest.approx(analysis.writhe(knot))
    through = np.stack([1 + np.cos(angle + 0.1), 0 * angle, np.sin(angle + 0.1)], axis=1)
    assert analysis.linking_number(circle, through) == pytest.approx(-1.0)
    assert analysis.linking_number(circle, through[::-1]) == pytest.approx(1.0)
    assert analysis.linking_number(circle, through + [5, 0, 0]) == pytest.approx(0.0, abs=1e-12)
    # A right-handed ribbon winds around its axis to the right.
    offset = np.cos(3 * angle)[:, None] * circle - np.sin(3 * angle)[:, None] * np.array([0, 0, 1.0])
    assert analysis.linking_number(circle, circle + 0.05 * offset) == pytest.approx(3.0)
    for nodes in (np.zeros((1, 3)), np.zeros(3), np.full((4, 3), np.nan)):
        with pytest.raises(InputError):
            analysis.writhe(nodes)
        with pytest.raises(InputError):
            analysis.linking_number(circle, nodes)


def test_closed_forms():
    """Numbers of A = 50 nm and C = 100 nm at 298 K, 0.5 pN and 8 pN nm, in segments of 5 nm and very short ones."""
    kT = BOLTZMANN * 298
    for length, shortening, stiffening in ((5.0, 0.21876, 1.574e-3), (0.01, 0.22072, 2.028e-3)):
        kind = FilamentType(
            torsional_rigidity=100 * kT,
            friction_length=100.0,
            **{**CHAIN, "segment_length": length, "bending_rigidity": 50 * kT},
        )
        force, torque = 0.5 * unit.piconewton, 8 * unit.piconewton * unit.nanometer
        chain = theory.twisted_chain(kind, force, torque, 298 * unit.kelvin)
        assert 1 - chain.relative_extension == pytest.approx(shortening, rel=2e-3)
        compliance = kT / chain.effective_torsional_rigidity - 1 / 100
        assert compliance == pytest.approx(stiffening, rel=2e-3)
        twist = 8 * 0.602214076 / (100 * kT) * length / (2 * np.pi)
        assert chain.turns_per_segment == pytest.approx(twist + chain.writhe_per_segment, rel=1e-3)
    with pytest.raises(InputError, match="stable up to"):
        theory.twisted_chain(DNA, KT, 20 * KT, TEMPERATURE)
    assert theory.critical_torque(DNA, KT) == pytest.approx(KT * np.sqrt(4 * 50 + 25))
    assert theory.ring_buckling_turns(DNA) == pytest.approx(0.866, rel=1e-3)
    assert theory.chain_mean_turn_cosine(DNA, 20, TEMPERATURE) == pytest.approx(np.exp(-0.5))
    for function, arguments in (
        (theory.twisted_chain, (DNA, -1.0, 0.0, TEMPERATURE)),
        (theory.twisted_chain, (DNA, 1.0, np.nan, TEMPERATURE)),
        (theory.twisted_chain, (UNTWISTED, 1.0, 0.0, TEMPERATURE)),
        (theory.critical_torque, (DNA, -1.0)),
        (theory.chain_twist_variance, (F_ACTIN, TEMPERATURE)),
        (theory.chain_mean_turn_cosine, (DNA, -1, TEMPERATURE)),
    ):
        with pytest.raises(InputError):
            function(*arguments)
