"""What becomes of each construct of Cytosim, in numbers: laws of its documentation against what our objects compute."""

import math

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain.cytosim.command import check
from openmm_cylchain.cytosim.drawing import Draw
from openmm_cylchain.cytosim.places import draw_position
from openmm_cylchain.cytosim.settings import Settings
from openmm_cylchain.cytosim.spaces import make_space
from openmm_cylchain.cytosim.translation import translate
from openmm_cylchain.errors import InputError
from openmm_cylchain.filaments.end_states import DynamicInstability, TwoUnitCap
from openmm_cylchain.runs.created_simulation import begin, create_simulation
from openmm_cylchain.units.quantities import BENDING_RIGIDITY, FORCE, STIFFNESS, VISCOSITY
from support.cytosim_files import CELL, MICROMETER, RUN, SECOND, SYSTEM, TUBE, translated


def test_solvent_and_run(tmp_path):
    found, document = translated(tmp_path, TUBE + "new tube { length = 3 }\n")
    # kT of 4.2e-21 J, and 0.5 pN s/um^2 = 0.5 Pa s.
    assert found.solvent.temperature == pytest.approx(4.2e-21 / 1.380649e-23, rel=1e-9)
    pascal_seconds = 0.5 * unit.pascal * unit.second * unit.AVOGADRO_CONSTANT_NA
    assert found.solvent.viscosity == pytest.approx(pascal_seconds.value_in_unit(VISCOSITY), rel=1e-9)
    settings = found.simulation
    assert (settings.time_step, settings.steps, settings.steps_per_report) == (1e9, 1000, 100)
    assert document.missing == []
    cold = SYSTEM.replace("kT = 0.0042", "kT = 0")
    found, _ = translated(tmp_path, TUBE + "new tube { length = 3 }\n", cold)
    assert found.solvent.temperature < 0.01


@pytest.mark.parametrize(("length", "segments"), [(3.0, 6), (2.6, 5), (0.3, 1), (1.15, 2), (1.26, 3)])
def test_a_fiber_has_the_segments_and_the_bending_of_cytosims(tmp_path, length, segments):
    found, _ = translated(tmp_path, TUBE + f"new tube {{ length = {length} }}\n")
    (group,) = found.filaments
    # N minimises |length/N - segmentation|: src/sim/chain.cc.
    assert group.segments == segments == min(range(1, 20), key=lambda n: abs(length / n - 0.5))
    assert group.type.segment_length == pytest.approx(1e3 * length / segments)
    rigidity = 20 * unit.piconewton * unit.micrometer**2 * unit.AVOGADRO_CONSTANT_NA
    assert group.type.bending_rigidity == pytest.approx(rigidity.value_in_unit(BENDING_RIGIDITY))
    assert group.type.bending_model == "kratky-porod"


@pytest.mark.parametrize(
    ("length", "keys", "drag"),
    [
        # 3 pi eta L/(ln(L/d) + 0.32), with L in the logarithm up to drag_length, src/sim/fiber.cc; eta = 0.5.
        (3.0, "", 3 * math.pi * 0.5 * 3 / (math.log(3 / 0.025) + 0.32)),
        (20.0, "", 3 * math.pi * 0.5 * 20 / (math.log(5 / 0.025) + 0.32)),
        (20.0, "drag_radius = 0.005; drag_length = 2;", 3 * math.pi * 0.5 * 20 / (math.log(2 / 0.01) + 0.32)),
        (3.0, "viscosity = 2;", 3 * math.pi * 2 * 3 / (math.log(3 / 0.025) + 0.32)),
        (3.0, "drag_model = 1, 0.01;", 2 * math.pi * 0.5 * 3 / math.acosh(1 + 0.01 / 0.0125)),
    ],
)
def test_friction_is_that_of_cytosim_along_and_across(tmp_path, length, keys, drag):
    text = f"set fiber tube {{ rigidity = 20; segmentation = 0.5; {keys} }}\nnew tube {{ length = {length} }}\n"
    found, _ = translated(tmp_path, text)
    (group,) = found.filaments
    friction = group.type.segment_friction(found.solvent.viscosity, found.solvent.temperature, group.segments)
    expected = drag * unit.piconewton * unit.second / unit.micrometer * unit.AVOGADRO_CONSTANT_NA
    expected = expected.value_in_unit(unit.kilojoule_per_mole * unit.picosecond / unit.nanometer**2)
    assert group.segments * friction.parallel == pytest.approx(expected, rel=1e-6)
    assert group.segments * friction.perpendicular == pytest.approx(expected, rel=1e-6)
    # That of drag which is spread evenly along a segment.
    own = expected / group.segments * group.type.segment_length**2 / 12
    assert friction.rotational == pytest.approx(own, rel=1e-6)


HAND = "set hand motor { binding = 10, 0.05; unbinding = 0.3, 2.5; activity = move; speed = 0.8; stall_force = 6 }\n"
COUPLE = "set couple link { hand1 = motor; hand2 = motor; stiffness = 100; length = 0.02; diffusion = fast }\n"


def test_hands_and_couples(tmp_path):
    text = TUBE + HAND + COUPLE + "new 4 tube { length = 3 }\nnew 50 link\nnew 30 link { attach1 = tube }\n"
    found, document = translated(tmp_path, text)
    (linkers,) = found.linkers
    (hand, other), kind = linkers.kind.hands, linkers.kind
    assert hand == other
    assert hand.binding_rate == pytest.approx(10 / SECOND)
    assert hand.reach == pytest.approx(50)
    assert hand.unbinding_rate == pytest.approx(0.3 / SECOND)
    force = unit.piconewton * unit.AVOGADRO_CONSTANT_NA
    assert hand.unbinding_force == pytest.approx((2.5 * force).value_in_unit(FORCE))
    assert hand.stall_force == pytest.approx((6 * force).value_in_unit(FORCE))
    assert hand.speed == pytest.approx(0.8 * MICROMETER / SECOND)
    assert kind.stiffness == pytest.approx((100 * force / unit.micrometer).value_in_unit(STIFFNESS))
    assert kind.rest_length == pytest.approx(20)
    assert (linkers.count, linkers.bound) == (80, 30)
    # From solution, hands bind to a length of filament at pi R^2 k/V, which is (2/3) pi R^2 k/V here.
    volume = 4 / 3 * math.pi * 4**3 * MICROMETER**3
    ours = hand.rate_per_length * 4 / 3 * math.pi * hand.reach**3 / linkers.volume
    assert ours == pytest.approx(math.pi * hand.reach**2 * hand.binding_rate / volume)
    assert document.missing == []


def test_hands_bind_from_solution_in_the_plane(tmp_path):
    flat = SYSTEM.replace("dim = 3", "dim = 2")
    text = TUBE + HAND + COUPLE + "new 4 tube { length = 3 }\nnew 50 link\n"
    found, _ = translated(tmp_path, text, flat)
    (linkers,) = found.linkers
    hand = linkers.kind.hands[0]
    ours = hand.rate_per_length * 4 / 3 * math.pi * hand.reach**3 / linkers.volume
    assert ours == pytest.approx(2 * hand.reach * hand.binding_rate / (math.pi * 4e3**2))
    assert all(group.planar for group in found.filaments)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_couples_diffuse_in_their_space(tmp_path, dimensions):
    text = TUBE + HAND + COUPLE.replace("fast", "0.3") + "new 4 tube { length = 3 }\nnew 50 link\n"
    found, document = translated(tmp_path, text, SYSTEM.replace("dim = 3", f"dim = {dimensions}"))
    assert document.missing == []
    (linkers,) = found.linkers
    assert linkers.diffusion == pytest.approx(0.3e-6) and linkers.volume is None
    assert linkers.planar == (dimensions == 2)
    assert linkers.region[0].radius == pytest.approx(4e3)


@pytest.mark.parametrize(
    ("couple", "missing"),
    [
        ("diffusion = fast; specificity = bipolar", "rules for pairs of hands"),
        ("diffusion = fast; activity = fork; torque = 1, 1", "links that hold an angle (fork)"),
        ("diffusion = fast; confine = surface", "surfaces: linkers on one"),
        ("diffusion = fast; glitter = 3", "couple: glitter"),
    ],
)
def test_what_couples_cannot_do_here_is_said(tmp_path, couple, missing):
    own = f"set couple link {{ hand1 = motor; hand2 = motor; stiffness = 100; {couple} }}\n"
    found, document = translated(tmp_path, TUBE + HAND + own + "new 4 tube { length = 3 }\nnew 50 link\n")
    assert document.missing == [missing]
    assert len(found.linkers) == 1
    assert "# left out" in document.text()


@pytest.mark.parametrize(
    ("hand", "missing", "said"),
    [
        ("activity = track; track_end = plus_end", "hands near ends", "track_end = plus_end"),
        ("activity = slide; diffusion = 3", "hands that diffuse alone", "it has no mobility"),
        ("activity = nucleate; nucleate = 1, tube", "hands: nucleate", "activity = nucleate"),
    ],
)
def test_what_hands_cannot_do_here_is_said(tmp_path, hand, missing, said):
    own = f"set hand motor {{ binding = 10, 0.05; unbinding = 1, 3; {hand} }}\n"
    _, document = translated(tmp_path, TUBE + own + COUPLE + "new 4 tube { length = 3 }\nnew 50 link\n")
    assert document.missing == [missing] and f"left out: hand motor: {said}" in document.text()


def test_rules_for_pairs_and_hands_that_slide(tmp_path):
    hands = "set hand slider { binding = 10, 0.05; unbinding = 1; activity = slide; mobility = 0.5 }\n"
    own = "set couple link { hand1 = motor; hand2 = slider; stiffness = 100; diffusion = fast; length = 0.04; "
    own += "trans_activated = 1; specificity = antiparallel; activity = bridge }\n"
    own += "set couple shackle { hand1 = slider; hand2 = motor; stiffness = 100; diffusion = fast; activity = slide }\n"
    made = "new 4 tube { length = 3 }\nnew 50 link\nnew 9 shackle\n"
    found, document = translated(tmp_path, TUBE + HAND + hands + own + made)
    assert document.missing == []
    first, second = (group.kind for group in found.linkers)
    assert (first.cosine_range, first.trans_activated, first.reversible) == ((-1.0, -0.5), True, False)
    friction = 0.602214076 * SECOND / MICROMETER
    slider = first.hands[1]
    assert slider.sliding_friction == pytest.approx(2.0 * friction) and slider.at_end == "release"
    assert not second.has_rules and second.reversible
    # A step of so long relaxes its spring.
    step = found.simulation.time_step
    assert second.hands[0].sliding_friction == pytest.approx(second.stiffness * step) and second.hands[0].holds_at_ends


def test_hands_that_hold_walk_on_sites_and_bind_to_some(tmp_path):
    text = (
        "set fiber tube { rigidity = 20; binding_key = 1 }\nset fiber actin { rigidity = 1; binding_key = 2 }\n"
        "set hand a { binding = 1, 0.02, 1; activity = walk; step_size = 0.008; unloaded_speed = -0.4; stall_force = 5;"
        " hold_growing_end = 0, 1 }\nset hand b { binding = 1, 0.02; binding_key = 3; }\n"
        "set couple link { hand1 = a; hand2 = b; stiffness = 100; diffusion = fast; min_loop = 0 }\n"
        "new 2 tube { length = 2 }\nnew 2 actin { length = 2 }\nnew 9 link\n"
    )
    found, _ = translated(tmp_path, text)
    (linkers,) = found.linkers
    a, b = linkers.kind.hands
    assert (a.at_end, a.site_spacing, a.binds_to, b.binds_to) == ("hold", 8.0, ("tube",), None)
    assert a.speed == pytest.approx(-0.4 * MICROMETER / SECOND)
    assert b.unbinding_rate == 0.0 and b.unbinding_force is None
    assert linkers.kind.same_filament


def test_grafted_singles_are_anchors(tmp_path):
    text = (
        TUBE
        + HAND
        + "set single grafted { hand = motor; stiffness = 100; activity = fixed }\nnew 2 tube { length = 3 }\n"
        + "new 100 grafted ( rectangle 2 1 0.5 )\nnew grafted { position = 1 2 3 }\nnew 50 grafted\n"
    )
    found, document = translated(tmp_path, text)
    (linkers,) = found.linkers
    anchors = 1e-3 * np.array(linkers.anchors)
    assert anchors.shape == (151, 3)
    assert np.all(np.abs(anchors[:100]) <= [1.0, 0.5, 0.25])
    assert np.all(anchors[:100].max(axis=0) > [0.8, 0.4, 0.2])
    assert anchors[100].tolist() == [1.0, 2.0, 3.0]
    assert np.all(np.linalg.norm(anchors[101:], axis=1) <= 4.0)
    assert document.missing == []


def test_singles_and_couples_that_stay_are_links(tmp_path):
    text = (
        TUBE
        + "set hand glue { binding = 10, 0.05; unbinding = 0, inf }\n"
        + "set single pin { hand = glue; stiffness = 50; activity = fixed }\n"
        + "set couple joint { hand1 = glue; hand2 = glue; stiffness = 100; length = 0.1; diffusion = 1 }\n"
        + "new tube { length = 3; position = 0 0 0; direction = 1 0 0 }\n"
        + "new tube { length = 2; position = 0 1 0; direction = X }\n"
        + "new pin { position = 0 0 1; attach = tube1, 1.5 }\n"
        + "new joint { attach1 = last-1, 0; attach2 = last, 0.5, plus_end }\n"
        + "new joint { attach1 = fiber1, 0, plus_end; attach2 = fiber2, 0.25, center }\n"
    )
    found, document = translated(tmp_path, text)
    pin, first, second = found.links
    assert pin.between[0]["arc_length"] == pytest.approx(1500)
    assert pin.between[1]["point"] == (0.0, 0.0, 1000.0)
    assert pin.rest_length == 0.0 and first.rest_length == pytest.approx(100)
    assert (first.between[0]["filament"], first.between[0]["node"]) == (0, 0)
    assert (first.between[1]["filament"], first.between[1]["arc_length"]) == (1, 1500.0)
    assert (second.between[0]["node"], second.between[1]["arc_length"]) == (-1, 1250.0)
    assert not found.linkers
    assert document.missing == []


def test_what_begins_bound_and_may_unbind_is_said(tmp_path):
    text = TUBE + HAND + COUPLE + "new tube { length = 3 }\nnew link { attach1 = tube1, 1; attach2 = tube1, 2 }\n"
    _, document = translated(tmp_path, text)
    assert document.missing == ["linkers that begin bound at given places"]


def test_fibers_that_are_held_at_their_ends_and_pulled(tmp_path):
    text = (
        "set hand glue { unbinding = 0, inf }\nset single pin { hand = glue; stiffness = 50; activity = fixed }\n"
        "set fiber tube { rigidity = 20; segmentation = 0.5; end_force = plus_end, 0 2 0 }\n"
        "new 3 tube { length = 3; attach1 = pin, 0, minus_end }\n"
    )
    found, document = translated(tmp_path, text)
    (tether,), (pull,) = found.tethers, found.pulls
    assert (tether.filaments, tether.node, tether.point) == ((0, 1, 2), 0, None)
    assert (pull.filaments, pull.node) == ((0, 1, 2), -1)
    newton = unit.piconewton * unit.AVOGADRO_CONSTANT_NA
    assert pull.force == pytest.approx((0.0, (2 * newton).value_in_unit(FORCE), 0.0))
    assert document.missing == []


@pytest.mark.parametrize(
    ("activity", "state", "plus", "minus", "kind"),
    [
        ("grow; growing_speed = 0.2, 0.1; growing_off_speed = -0.05", "plus_end = grow", (0.2, 0.05), None, None),
        ("grow; growing_speed = 0.2, 0.1", "end_state = 1, green", (0.2, 0.0), (0.1, 0.0), None),
        ("treadmill; growing_speed = 0.2; shrinking_speed = 0, -0.1", "end_state = 1, 4", (0.2, 0.0), (0.0, 0.1), None),
        (
            "classic; growing_speed = 0.2; shrinking_speed = -0.4; catastrophe_rate = 0.02; rescue_rate = 0.1",
            "plus_end = grow",
            (0.2, 0.0),
            None,
            DynamicInstability,
        ),
        (
            "dynamic; unit_length = 0.01; growing_speed = 0.2; shrinking_speed = -0.4; hydrolysis_rate = 0.3",
            "plus_end = grow",
            (0.2, 0.0),
            None,
            TwoUnitCap,
        ),
    ],
)
def test_growth_has_the_speeds_of_cytosim(tmp_path, activity, state, plus, minus, kind):
    own = "set fiber tube { rigidity = 20; segmentation = 0.5; min_length = 0.1; growing_force = 1.7; "
    own += f"activity = {activity} }}\n"
    found, document = translated(tmp_path, own + f"new 3 tube {{ length = 2; {state} }}\n")
    (group,) = found.filaments
    growth = group.growth
    length = growth.monomers.length
    for end, expected in (("plus", plus), ("minus", minus)):
        on, off = growth.rates(end)
        speeds = [on * growth.pool.concentration * length, off * length]
        assert speeds == pytest.approx([own * MICROMETER / SECOND for own in expected or (0.0, 0.0)], abs=1e-16)
        assert getattr(growth, f"{end}_capped") == (expected is None)
    force = 1.7 * unit.piconewton * unit.AVOGADRO_CONSTANT_NA
    assert growth.growing_force == pytest.approx(force.value_in_unit(FORCE))
    assert growth.deterministic == (kind is not TwoUnitCap)
    assert growth.vanishes == ("shrink" in activity or "off" in activity)
    turns = growth.plus_instability
    assert kind is None or isinstance(turns, kind)
    if kind is DynamicInstability:
        rates = (turns.catastrophe_rate, turns.rescue_rate, turns.shrinking_off_rate * length)
        assert rates == pytest.approx((0.02 / SECOND, 0.1 / SECOND, 0.4 * MICROMETER / SECOND))
    if kind is TwoUnitCap:
        assert length == pytest.approx(10)
        rates = (turns.hydrolysis_rate, turns.shrinking_off_rate * length)
        assert rates == pytest.approx((0.3 / SECOND, 0.4 * MICROMETER / SECOND))
    assert growth.longest == pytest.approx(2e3 + 1.05 * 0.2e3 * 1.0, rel=0.1)
    assert document.missing == []


def test_fibers_share_a_pool_of_polymer(tmp_path):
    own = "set fiber tube { rigidity = 20; activity = grow; growing_speed = 0.5; total_polymer = 40; max_length = 9 }\n"
    found, _ = translated(
        tmp_path, own + "new 3 tube { length = 2; plus_end = grow }\nnew tube { length = 4; plus_end = grow }\n"
    )
    pools = {id(group.growth.pool): group.growth.pool for group in found.filaments}
    (pool,) = pools.values()
    growth = found.filaments[0].growth
    length, on = growth.monomers.length, growth.monomers.plus_on_rate
    # growing_speed * (1 - sum(length)/total_polymer), at first and when all of it is free.
    assert on * pool.concentration * length == pytest.approx(0.5 * (1 - 10 / 40) * MICROMETER / SECOND)
    whole = pool.concentration + 10e3 / length / pool.volume
    assert on * whole * length == pytest.approx(0.5 * MICROMETER / SECOND)
    assert growth.longest == pytest.approx(min(9e3, 2e3 + 1.05 * 500), rel=0.1)


@pytest.mark.parametrize(
    ("keys", "state", "missing"),
    [
        ("activity = dynamic; hydrolysis_rate = 0.1", "plus_end = shrink", "begin by shrinking"),
        ("activity = vector_growth", "plus_end = grow", "growth: vector_growth"),
    ],
)
def test_what_ends_cannot_do_here_is_said(tmp_path, keys, state, missing):
    own = f"set fiber tube {{ rigidity = 20; growing_speed = 0.5; shrinking_speed = -1; {keys} }}\n"
    _, document = translated(tmp_path, own + f"new 3 tube {{ length = 2; {state} }}\n")
    assert len(document.missing) == 1 and missing in document.missing[0]


def test_filaments_are_held_at_places(tmp_path):
    text = "set hand glue { binding = 10, 0.05; unbinding = 0, inf }\n"
    text += "set single clamp { hand = glue; stiffness = 100; activity = fixed }\n" + TUBE
    text += "new 2 tube { length = 3; direction = 1 0 0; attach1 = clamp, 1; attach2 = clamp, 0.6, plus_end; "
    text += "attach3 = clamp, 0, center,, 1 2 3; attach4 = clamp, 3 }\n"
    found, document = translated(tmp_path, text)
    # Nodes are 0.5 um apart.
    assert [tether.node for tether in found.tethers] == [2, 5, 3, -1]
    assert [tether.point for tether in found.tethers] == [None, None, (1000.0, 2000.0, 3000.0), None]
    assert all(tether.filaments == (0, 1) for tether in found.tethers) and document.missing == []
    assert [note.text for note in document.notes if "nearest one" in note.text] == [
        "the nearest one, 0.1 um from there"
    ]
    found, _ = translated(tmp_path, text.replace("clamp, 1;", "clamp, 0;").replace("0.6, plus_end", "0.2"))
    # Each node is held once.
    assert [tether.node for tether in found.tethers] == [0, 1, 3, -1]
    _, document = translated(tmp_path, text.replace("clamp, 3 ", "clamp, 4 "))
    assert document.missing == ["linkers that begin bound at given places"]


def test_forces_at_the_middle(tmp_path):
    own = "set fiber tube { rigidity = 20; segmentation = 0.5; end_force = 0 2 0, center }\n"
    found, document = translated(tmp_path, own + "new tube { length = 3 }\n")
    assert found.pulls[0].node == 3 and document.missing == []
    _, document = translated(tmp_path, own + "new tube { length = 2.5 }\n")
    assert document.missing == ["forces on ends that grow, or on middles"]


def test_fibers_that_stand_still(tmp_path):
    """They diffuse by less than a nanometre in the whole run."""
    found, document = translated(tmp_path, TUBE + "new tube { length = 3 }\n", run="run 1000 system { solve = 0 }\n")
    group, solvent = found.filaments[0], found.solvent
    friction = group.type.segment_friction(solvent.viscosity, solvent.temperature, group.segments).parallel
    diffusion = 8.314462618e-3 * solvent.temperature / (friction * group.segments)
    assert math.sqrt(6 * diffusion * found.simulation.steps * found.simulation.time_step) < 1.0
    assert document.missing == []


def settings_with(sizes):
    settings = Settings("space", 1)
    for part in sizes.split(";"):
        key, _, values = part.partition("=")
        settings.set(key.strip(), [own.strip() for own in values.split(",")], 1)
    return settings


@pytest.mark.parametrize(("dimensions", "shape"), [(2, "circle"), (3, "sphere")])
def test_places_on_the_surface_of_a_sphere(tmp_path, dimensions, shape):
    space = make_space(shape, [settings_with("radius = 4")], dimensions)
    draw = Draw(space, dimensions, np.random.default_rng(3), 1)
    found = np.array([draw_position("surface", draw) for _ in range(2000)])
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 4.0)
    assert np.all(np.abs(found.mean(axis=0)) < 4 * 4 / np.sqrt(dimensions * 2000))
    within = np.linalg.norm([draw_position("edge 1", draw) for _ in range(2000)], axis=1)
    assert within.min() > 3.0 and within.max() < 4.0
    # Evenly in the shell: so many are in its inner half.
    share = (3.5**dimensions - 3**dimensions) / (4**dimensions - 3**dimensions)
    assert abs(np.mean(within < 3.5) - share) < 4 * math.sqrt(share * (1 - share) / 2000)
    text = HAND + "set single fixed_one { hand = motor; activity = fixed; stiffness = 10 }\n" + TUBE
    text += "new tube { length = 2 }\nnew 20 fixed_one ( surface )\n"
    _, document = translated(tmp_path, text)
    assert document.missing == []
    box = "set space cell { shape = square }\nnew cell { length = 9 9 9 }\n"
    _, document = translated(tmp_path, text, cell=box.replace("9 9 9", "9, 9, 9"))
    assert document.missing == ["positions: surface"]


def test_static_ends_do_not_grow(tmp_path):
    own = "set fiber tube { rigidity = 20; activity = grow; growing_speed = 0.5 }\n"
    found, document = translated(tmp_path, own + "new 3 tube { length = 2 }\n")
    assert found.filaments[0].growth is None
    assert document.missing == []


def test_events_begin_fibers(tmp_path):
    own = "set fiber tube { rigidity = 20; activity = grow; growing_speed = 0.5 }\n"
    event = "new event { rate = 3; code = ( new tube { length = 0.5; plus_end = grow; position = ball 2; } ) }\n"
    found, document = translated(tmp_path, own + event)
    (group,) = found.filaments
    assert group.is_reserve
    assert group.nucleation.rate == pytest.approx(3 / SECOND)
    assert group.nucleation.length == pytest.approx(500, rel=0.02)
    assert document.missing == []
    # The same in a run.
    code = "( new tube { length = 0.5; plus_end = grow; position = ball 2; } )"
    found, document = translated(tmp_path, own, run=f"run 1000 system {{ event = 3, {code} }}\n")
    assert found.filaments[-1].nucleation.rate == pytest.approx(3 / SECOND)
    assert document.missing == []
    _, document = translated(tmp_path, TUBE + "new tube\nnew event { rate = 3; code = ( delete 1 tube ) }\n")
    assert document.missing == ["events during a run"]
    _, document = translated(tmp_path, TUBE + "new tube\nnew event { delay = 3; code = (report fiber x.txt {a=1}) }\n")
    assert document.missing == []


def test_contacts_of_fibers_are_those_of_their_properties(tmp_path):
    system = SYSTEM.replace("dim = 3", "dim = 3; steric = 1, 500")
    fibers = "".join(
        f"set fiber {name} {{ rigidity = 20; steric = {steric} }}\nnew 3 {name} {{ length = 2 }}\n"
        for name, steric in (("thin", "1, 0.015"), ("thick", "1, 0.02"), ("none", "0"), ("thick2", "1, 0.02"))
    )
    found, document = translated(tmp_path, fibers, system)
    assert [own.contact_diameter for own in found.filaments] == [30, 40, None, 40]
    assert document.missing == []
    text = document.text()
    assert text.count("contact_diameter") == text.count("contacts = false") == 1
    # Keys of steric say which of them touch each other, where Cytosim is built for several.
    _, document = translated(tmp_path, fibers.replace("1, 0.015", "2, 0.015"), system)
    assert document.missing == ["contacts between some of those that have some"]
    assert "thin 2, thick 1, thick2 1" in document.text()
    # Without steric of the system there are none, and in a later run they are others.
    found, _ = translated(tmp_path, fibers)
    assert found.contacts is None and [own.contact_diameter for own in found.filaments] == [None] * 4
    change = "run 100 system\nchange thin { steric = 1, 0.02 }\nchange none { steric = 1, 0.014 }\n"
    change += "run 100 system\nchange system { steric = 0 }\n"
    found, document = translated(tmp_path, fibers + change, system)
    diameters = [[own.contact_diameter for own in stage.configuration.filaments] for stage in found.stages]
    assert diameters == [[30, 40, None, 40], [40, 40, 28, 40], [None] * 4]
    assert document.missing == []
    # Fibers that come later, and contacts that come with them, beside beads that push each other before.
    thin, later = fibers.split("set fiber thick ")
    bead = "set bead ball { steric = 1 }\nnew 2 ball { radius = 0.1 }\n"
    for first in (thin.replace("1, 0.015", "1, 0.05"), bead):
        off = system.replace("steric = 1", "steric = 0") if first != bead else system
        comes = "run 100 system\nchange system { steric = 1, 500 }\nset fiber thick " + later
        found, document = translated(tmp_path, first + comes, off)
        kept = [own.contact_diameter for own in found.stages[1].configuration.filaments]
        assert kept == [100] * (first != bead) + [40, None, 40]
        assert document.missing == []


def test_walls_contacts_and_boxes(tmp_path):
    system = SYSTEM.replace("dim = 3", "dim = 3; steric = 1, 500")
    own = "set fiber tube { rigidity = 20; confine = inside, 200; steric = 1, 0.01 }\nnew 3 tube { length = 2 }\n"
    found, document = translated(tmp_path, own, system)
    (wall,) = found.walls
    stiffness = unit.piconewton / unit.micrometer * unit.AVOGADRO_CONSTANT_NA
    assert wall.stiffness == pytest.approx((200 * stiffness).value_in_unit(STIFFNESS))
    assert wall.shape.radius == 4000
    assert found.filaments[0].contact_diameter == 20
    assert found.contacts.stiffness == pytest.approx((500 * stiffness).value_in_unit(STIFFNESS))
    assert document.missing == []
    periodic = "set space cell { shape = periodic }\nnew cell { length = 5, 6, 7 }\n"
    found, _ = translated(tmp_path, TUBE + "new 3 tube { length = 2 }\n", cell=periodic)
    assert found.box == (5000.0, 6000.0, 7000.0)
    capsule = "set space cell { shape = capsule }\nnew cell { length = 8; radius = 1 }\n"
    found, document = translated(tmp_path, own, cell=capsule)
    assert found.walls[0].shape.length == 6000 and found.walls[0].shape.radius == 1000
    assert document.missing == []
    for dimensions in (3, 2):
        torus = "set space cell { shape = torus }\nnew cell { curvature = 6; width = 3 }\n"
        found, document = translated(tmp_path, own, system.replace("dim = 3", f"dim = {dimensions}"), cell=torus)
        shape = found.walls[0].shape
        assert (shape.major_radius, shape.minor_radius, shape.axis.tolist()) == (6000, 1500, [0, 0, 1])
        assert document.missing == []


def test_walls_of_two_cylinders_that_cross(tmp_path):
    cell = "set space cell { shape = bicylinder }\nnew cell { radius = 4 }\n"
    fiber = "set fiber tube { rigidity = 20; confine = inside, 100 }\nnew 9 tube { length = 1 }\n"
    found, document = translated(tmp_path, fiber, cell=cell)
    assert [wall.shape.axis.tolist() for wall in found.walls] == [[1, 0, 0], [0, 1, 0]]
    assert document.missing == []
    middles = np.array(found.filaments[0].positions).mean(axis=1) / MICROMETER
    assert np.all(np.maximum(middles[:, 0] ** 2, middles[:, 1] ** 2) + middles[:, 2] ** 2 <= 16.0)
    _, document = translated(tmp_path, fiber.replace("inside", "on"), cell=cell)
    assert document.missing == ["surfaces: surface of a bicylinder"]


def test_walls_of_some_fibers_and_several_of_one(tmp_path):
    cells = "set space cell { shape = sphere }\nnew cell { radius = 9 }\n"
    cells += "set space core { shape = capsule }\nnew core { length = 8; radius = 2 }\n"
    fibers = (
        "set fiber tube { rigidity = 20; confine = inside, 200; confine2 = inside, 50, core }\n"
        "set fiber actin { rigidity = 0.07; confine = inside, 200 }\n"
        "set fiber free { rigidity = 0.07 }\n"
    )
    made = "new 3 tube { length = 2 }\nnew 2 actin { length = 1 }\n"
    found, document = translated(tmp_path, fibers + made, cell=cells)
    assert [wall.shape.radius for wall in found.walls] == [9000, 2000]
    assert [wall.held_types for wall in found.walls] == [None, ("tube",)]
    assert found.walls[1].stiffness == pytest.approx(found.walls[0].stiffness / 4)
    assert document.missing == []
    found, document = translated(tmp_path, fibers + made + "new free { length = 1 }\n", cell=cells)
    assert [wall.held_types for wall in found.walls] == [("tube", "actin"), ("tube",)]


def test_walls_on_surfaces_outside_and_of_bodies(tmp_path):
    cells = "set space cell { shape = sphere }\nnew cell { radius = 9 }\n"
    cells += "set space core { shape = capsule }\nnew core { length = 8; radius = 2 }\n"
    cells += "set space tin { shape = cylinderZ }\nnew tin { bottom = -3; top = 3; radius = 4 }\n"
    cells += "set space carton { shape = square }\nnew carton { length = 6, 6, 6 }\n"
    made = "new 2 tube { length = 2 }\nnew 2 actin { length = 1 }\n"

    def walls(tube, actin="", solid="", more=""):
        text = (
            f"set fiber tube {{ rigidity = 20; {tube} }}\nset fiber actin {{ rigidity = 0.07; {actin} }}\n"
            f"set solid pole {{ {solid} }}\n{made}"
        )
        if solid:
            text += "new pole { point1 = 0 0 0, 0.3; point2 = 0 0 1, 0.1 }\n"
        found, document = translated(tmp_path, text + more, cell=cells)
        return [(own.side, own.nodes, own.held_types, type(own.shape).__name__) for own in found.walls], document

    found, document = walls("confine = on, 100", "confine = outside, 50, core")
    assert found == [("surface", "all", ("tube",), "Sphere"), ("outside", "all", ("actin",), "Capsule")]
    assert document.missing == []
    found, document = walls("confine = inside, 100", "confine = inside, 100", "confine = inside, 100")
    assert (
        found == [("inside", "all", None, "Sphere")] and document.tables_called("[[wall]]")[0].value("whole") is False
    )
    found, document = walls("confine = inside, 100", "confine = inside, 100", "confine = on, 500")
    assert found == [("inside", "all", ("tube", "actin"), "Sphere"), ("surface", "all", ("pole",), "Sphere")]
    found, document = walls("confine = both_ends, 100", "confine = plus_end, 100, core", "confine = point, 500")
    assert [own[:3] for own in found] == [
        ("surface", "ends", ("tube",)),
        ("surface", "last", ("actin",)),
        ("surface", "first", ("pole",)),
    ]
    found, document = walls("confine = surface, 100, tin")
    assert found == [("surface", "all", ("tube",), "Cylinder"), ("inside", "all", ("tube",), "Slab")]
    assert any("ends keep inside" in note.text for note in document.notes) and document.missing == []
    found, document = walls("confine = outside, 100, tin")
    assert found == [("outside", "all", ("tube",), "Cylinder")]
    assert any("no ends" in note.text for note in document.notes) and document.missing == []
    found, document = walls("confine = in_out, 20, 50, core", "confine = in_out, 50, 20, core")
    assert [own[:3] for own in found] == [
        ("surface", "all", None),
        ("inside", "all", ("tube",)),
        ("outside", "all", ("actin",)),
    ]
    for confine, needs in (
        ("on, 100, carton", "surfaces: surface of a square"),
        ("outside, 100, carton", "surfaces: outside of a square"),
        ("elsewhere, 100", "surfaces: confine = elsewhere"),
    ):
        found, document = walls(f"confine = {confine}")
        assert found == [] and document.missing == [needs]
    growing = "confine = plus_end, 100; activity = classic; growing_speed = 0.1, 0; growing_force = 5"
    assert walls(growing)[1].missing == ["surfaces: ends that grow"]
    _, document = walls("confine = on, 100", more="run 10 system { nb_frames = 1 }\nchange tube { confine = inside }\n")
    assert document.missing == []


def test_two_dimensions_are_found(tmp_path):
    system, tube = SYSTEM.replace("; dim = 3", ""), TUBE + "new 3 tube { length = 2 }\n"
    for shape, size, planar in (
        ("circle", "radius = 4", True),
        ("sphere", "radius = 4", False),
        ("rectangle", "length = 8, 8", True),
        ("rectangle", "length = 8, 8, 8", False),
    ):
        cell = f"set space cell {{ shape = {shape} }}\nnew cell {{ {size} }}\n"
        found, document = translated(tmp_path, tube, system, cell)
        assert {group.planar for group in found.filaments} == {planar}
        assert any("--dimensions" in note.text for note in document.notes)
    found, document = translated(tmp_path, tube, system, cell, dimensions=2)
    assert found.filaments[0].planar and not any("--dimensions" in note.text for note in document.notes)


def test_parts_and_fields_are_said(tmp_path):
    text = TUBE + "new tube\nset field ball { confine = off }\nnew ball\nrun 5000 system\ncut tube\n"
    text += "new tube\n"
    _, document = translated(tmp_path, text)
    assert document.missing == ["stages: filaments that go by where they are, or come and grow", "fields"]


def test_runs_become_stages(tmp_path):
    """What ``change``, ``new`` and ``delete`` between runs say, in the configurations of stages."""
    tube = TUBE.replace("segmentation", "confine = inside, 100; segmentation")
    link = COUPLE.replace("couple link", "couple other")
    text = (
        tube
        + HAND
        + COUPLE
        + link
        + (
            "new 4 tube { length = 3 }\nnew 50 link\nrun 100 system { nb_frames = 10 }\n"
            "new 30 link { attach1 = tube }\nchange motor { speed = 0; unbinding = 0.6, inf }\n"
            "run 200 system { nb_frames = 4 }\n"
            "change cell { radius = 3.8 }\nchange tube { rigidity = 10 }\ndelete 20 link\nnew 10 other\n"
            "change system { time_step = 0.0005; viscosity = 1 }\n"
        )
    )
    found, document = translated(tmp_path, text, run="run 400 system { nb_frames = 4 }\n")
    assert document.missing == []
    own = [stage.configuration for stage in found.stages]
    assert [stage.name for stage in found.stages] == ["run 1", "run 2", "run 3"]
    assert [one.simulation.steps for one in own] == [100, 200, 400]
    assert [one.simulation.steps_per_report for one in own] == [10, 50, 100]
    assert [one.simulation.time_step for one in own] == [1e9, 1e9, 5e8]
    assert [one.linkers[0].count for one in own] == [50, 80, 60]
    assert [one.linkers[1].count for one in own] == [0, 0, 10]
    assert [sorted(stage.bound) for stage in found.stages] == [[], [0], []]
    assert own[1].linkers[0].bound == 30
    hands = [one.linkers[0].kind.hands[0] for one in own]
    assert [hand.speed * SECOND / MICROMETER for hand in hands] == pytest.approx([0.8, 0.0, 0.0])
    assert [hand.unbinding_rate * SECOND for hand in hands] == pytest.approx([0.3, 0.6, 0.6])
    # No force speeds up unbinding any more.
    assert hands[1].unbinding_force > 1e5 * hands[0].unbinding_force
    assert [one.walls[0].shape.radius for one in own] == [4000.0, 4000.0, 3800.0]
    volumes = np.array([one.linkers[0].volume for one in own])
    assert volumes / volumes[0] == pytest.approx([1.0, 1.0, (3.8 / 4) ** 3])
    rigidities = np.array([one.filaments[0].type.bending_rigidity for one in own])
    assert rigidities / rigidities[0] == pytest.approx([1.0, 1.0, 0.5])
    assert own[2].solvent.viscosity == pytest.approx(2.0 * own[0].solvent.viscosity)


def test_links_confinement_and_steric_come_and_go(tmp_path):
    hold = "set hand hold { binding = 10, 0.05; unbinding = 0, inf }\n"
    link = "set couple bond { hand1 = hold; hand2 = hold; stiffness = 100 }\n"
    text = (
        TUBE
        + hold
        + link
        + (
            "new 2 tube { length = 3; position = 0 0 0; direction = 1 0 0; placement = off }\nrun 100 system\n"
            "new bond { attach1 = fiber1, 0; attach2 = fiber2, 0 }\nchange tube { confine = inside, 100 }\n"
            "run 100 system\n"
            "change tube { confine = off }\nchange bond { stiffness = 200 }\n"
        )
    )
    found, document = translated(tmp_path, text)
    assert document.missing == []
    own = [stage.configuration for stage in found.stages]
    assert [len(one.links) for one in own] == [0, 1, 1]
    assert own[2].links[0].stiffness == pytest.approx(2.0 * own[1].links[0].stiffness)
    assert [len(one.walls) for one in own] == [0, 1, 0]


def test_fibers_come_with_a_run(tmp_path):
    """Those with places in a line and those with places in a file, and a couple that joins two of them then."""
    hold = "set hand hold { binding = 10, 0.05; unbinding = 0, inf }\n"
    link = "set couple bond { hand1 = hold; hand2 = hold; stiffness = 100 }\n"
    shape = "shape = 0 0 0, 1 0 0, 1.5 0.5 0; placement = off"
    text = (
        TUBE
        + hold
        + link
        + (
            f"new 2 tube {{ length = 3 }}\nnew tube {{ {shape} }}\nrun 100 system\n"
            f"new tube {{ {shape} }}\nrun 50 system\n"
            "new 3 tube { length = 2 }\nnew bond { attach1 = fiber1, 0; attach2 = fiber4, 0.5 }\n"
        )
    )
    found, document = translated(tmp_path, text)
    assert document.missing == []
    every = [stage.configuration for stage in found.stages]
    assert [[group.count for group in own.filaments if group.active] for own in every] == [
        [2, 1],
        [2, 1, 1],
        [2, 1, 1, 3],
    ]
    assert [len(own.links) for own in every] == [0, 0, 1]
    assert [place["filament"] for place in every[2].links[0].between] == [0, 3]


def test_the_last_fiber_is_that_of_its_time(tmp_path):
    hold = "set hand hold { binding = 10, 0.05; unbinding = 0, inf }\n"
    link = "set couple bond { hand1 = hold; hand2 = hold; stiffness = 100 }\n"
    bond = "new bond { attach1 = fiber1, 0; attach2 = last, 0.5 }\n"
    tube = "new tube { length = 3 }\n"
    found, document = translated(tmp_path, TUBE + hold + link + tube + tube + bond + "run 10 system\n" + tube + bond)
    assert document.missing == []
    links = found.stages[1].configuration.links
    assert [own.between[1]["filament"] for own in links] == [1, 2]


def test_fibers_that_grow_do_not_come_with_a_run(tmp_path):
    text = TUBE.replace("segmentation", "activity = grow; growing_speed = 0.1; segmentation")
    found, document = translated(tmp_path, text + "new tube\nrun 5 system\nnew tube\n")
    assert not found.stages
    assert document.missing == ["stages: filaments that go by where they are, or come and grow"]


def test_fibers_go_with_a_run(tmp_path):
    """So many of them, or all; those that grow, too; not those that are cut or go by where they are."""
    other = TUBE.replace("fiber tube", "fiber actin")
    grown = TUBE.replace("fiber tube", "fiber micro")
    grown = grown.replace("segmentation", "activity = grow; growing_speed = 0.1; segmentation")
    text = TUBE + other + grown + "new 4 tube { length = 3 }\nnew 6 actin { length = 2 }\nnew 3 micro\n"
    text += (
        "run 100 system\ndelete 2 tube\nrun 50 system\ndelete all actin\ndelete 1 micro\nrun 50 system\ndelete 9 tube\n"
    )
    found, document = translated(tmp_path, text)
    assert document.missing == []
    every = [stage.configuration.filaments for stage in found.stages]
    counts = [[own.delete and own.delete.count for own in groups] for groups in every]
    assert counts == [[None] * 3, [2, None, None], [None, None, 1], [2, None, None]]
    assert [own.delete is not None for own in every[2]] == [False, True, True]
    several = TUBE + "new 2 tube { length = 3 }\nnew 3 tube { length = 1 }\nrun 5 system\ndelete 4 fiber\n"
    found, document = translated(tmp_path, several)
    assert document.missing == []
    assert [own.delete.count for own in found.stages[1].configuration.filaments] == [2, 2]
    for what in ("delete tube { position = inside, cell }", "cut 3 tube { plane = 1 0 0, 0 }"):
        found, document = translated(tmp_path, TUBE + f"new 4 tube {{ length = 3 }}\nrun 100 system\n{what}\n")
        assert not found.stages
        assert document.missing == ["stages: filaments that go by where they are, or come and grow"]


def test_planes_cut_fibers_between_runs(tmp_path):
    """Where n.x + a = 0; of one name or all, several at once, also of fibers that grow."""
    grown = TUBE.replace("fiber tube", "fiber micro").split("set fiber")[1]
    grown = "set fiber" + grown.replace("segmentation", "activity = grow; growing_speed = 0.1; segmentation")
    text = TUBE + grown + "new 4 tube { length = 3 }\nnew 2 micro { plus_end = grow }\nrun 100 system\n"
    text += "cut tube { plane = 0 2 0, 1 }\n"
    text += (
        "cut fiber { plane = 1 0 0, -0.5; new_end_state = static, static }\nrun 50 system\ncut tube\nrun 50 system\n"
    )
    found, document = translated(tmp_path, text)
    assert document.missing == ["growth: states of new ends"]
    cuts = [[group.cuts for group in stage.configuration.filaments[:2]] for stage in found.stages]
    assert [[len(own) for own in stage] for stage in cuts] == [[0, 0], [2, 1], [1, 0]]
    first, second = cuts[1][0]
    np.testing.assert_allclose((first.point, first.normal), ([0, -500, 0], [0, 1, 0]))
    np.testing.assert_allclose((second.point, second.normal), ([500, 0, 0], [1, 0, 0]))
    np.testing.assert_allclose(cuts[2][0][0].normal, [1, 0, 0])
    growths = [group.growth for group in found.filaments]
    assert all(own.severing is not None for own in growths) and growths[0].plus_capped and not growths[1].plus_capped
    cell = "set space cell { shape = periodic }\nnew cell { length = 8, 8, 8 }\n"
    found, document = translated(tmp_path, text, cell=cell)
    assert not any(group.cuts for stage in found.stages for group in stage.configuration.filaments)
    assert "stages: cuts in a periodic box" in document.missing


@pytest.mark.parametrize(
    "points", ["order = 5; radius = 3", "points = 0 0, 0 2, 3 3, 2 0, 1 0", "points = 0 0, 4 0, 2 3"]
)
@pytest.mark.parametrize("dimensions", [2, 3])
def test_convex_polygons_have_planes(tmp_path, points, dimensions):
    tube = TUBE.replace("segmentation", "confine = inside, 100; segmentation")
    points += "; height = 2" * (dimensions == 3)
    cell = f"set space cell {{ shape = polygon }}\nnew cell {{ {points} }}\n"
    system = SYSTEM.replace("dim = 3", f"dim = {dimensions}")
    found, document = translated(tmp_path, tube + "new 3 tube { length = 0.5 }\n", system, cell=cell)
    assert document.missing == []
    space = make_space("polygon", [settings_with(points)], dimensions)
    places = space.middle + 1.5 * np.array([*space.half[:2], 1.0]) * np.random.default_rng(2).uniform(-1, 1, (3000, 3))
    places[:, 2] *= dimensions == 3
    within = np.all([own.shape.square_depth(1e3 * places) == 0.0 for own in found.walls], axis=0)
    np.testing.assert_array_equal(within, space.inside(places))
    assert 300 < within.sum() < 2700
    corners = {"order = 5": 5, "points = 0 0, 0": 4, "points = 0 0, 4": 3}
    assert len(found.walls) == next(own for name, own in corners.items() if points.startswith(name)) + dimensions - 2
    assert len(document.tables_called("[[wall]]")) == 1


@pytest.mark.parametrize("points", ["points = 0 0, 3 0, 3 1, 1 1, 1 3, 0 3", "points = 0 3, 2 -2, -3 1, 3 1, -2 -2"])
def test_other_polygons_have_no_walls(tmp_path, points):
    tube = TUBE.replace("segmentation", "confine = inside, 100; segmentation")
    cell = f"set space cell {{ shape = polygon }}\nnew cell {{ {points}; height = 2 }}\n"
    found, document = translated(tmp_path, tube + "new 3 tube { length = 0.5 }\n", cell=cell)
    assert document.missing == ["walls: polygon"] and not found.walls


def test_what_a_stage_cannot_change_is_said(tmp_path):
    text = TUBE + "new tube { length = 3 }\nrun 100 system\nchange tube { segmentation = 0.25 }\n"
    found, document = translated(tmp_path, text)
    assert len(found.stages) == 2
    assert document.missing == ["stages: another segment_length", "stages: another segments"]


def test_fibers_begin_where_they_are_told_to(tmp_path):
    text = TUBE + (
        "new tube { length = 2; position = 1 0 0; direction = 0 1 0 }\n"
        "new tube { length = 2; position = 1 0 0; direction = 0 1 0; reference = minus_end }\n"
        "new 3 tube { length = 2; range = -1 0 0, 1 0 0; orientation = 0 0 2 }\n"
        "new tube { position_ends = 0 0 0, 0 0 3 }\n"
        "new tube { shape = 0 0 0, 1 0 0, 1 1 0; placement = off }\n"
        "new 200 tube { length = 1, 0.5; direction = parallel X }\n"
    )
    found, _ = translated(tmp_path, text)
    first, second, row, ends, bent, *many = found.filaments
    assert first.position == (1000.0, -1000.0, 0.0) and second.position == (1000.0, 0.0, 0.0)
    assert [start[0].tolist() for start in row.positions] == [[x, 0.0, -1000.0] for x in (-1000.0, 0.0, 1000.0)]
    assert [start[-1][2] for start in row.positions] == [1000.0] * 3
    assert ends.position == (0.0, 0.0, 0.0) and ends.segments * ends.type.segment_length == pytest.approx(3000)
    assert bent.segments == 4 and len(bent.positions[0]) == 5
    assert sum(group.count for group in many) == 200
    lengths = [group.segments * group.type.segment_length for group in many]
    assert np.average(lengths, weights=[group.count for group in many]) == pytest.approx(1000, rel=0.01)
    assert all(group.orientation == "nematic" for group in many)


def test_long_fibers_begin_as_cytosim_has_them(tmp_path):
    # Their middles are in the space, while their ends are not.
    found, _ = translated(tmp_path, TUBE + "new 40 tube { length = 12 }\n")
    (group,) = found.filaments
    nodes = np.array(group.positions)
    assert nodes.shape == (40, 25, 3)
    assert np.all(np.linalg.norm(nodes[:, 12], axis=1) < 4000)
    steps = np.linalg.norm(np.diff(nodes, axis=1), axis=2)
    assert np.allclose(steps, 500)


SHAPES = [
    ("sphere", "radius = 2", 3),
    ("circle", "diameter = 3", 2),
    ("rectangle", "length = 2, 3, 4", 3),
    ("capsule", "length = 6; radius = 1", 3),
    ("capsule", "length = 6; radius = 1", 2),
    ("ellipse", "length = 2, 3, 4", 3),
    ("cylinder", "length = 4; radius = 1", 3),
    ("cylinderZ", "bottom = -1; top = 2; radius = 1", 3),
    ("bicylinder", "radius = 2", 3),
    ("torus", "curvature = 3; width = 1", 3),
    ("torus", "curvature = 3; width = 1", 2),
    ("annulus", "inner = 1; outer = 2", 2),
    ("annulus", "radius = 2; width = 1; bottom = 0; top = 3", 3),
    ("dice", "length = 2, 2, 2; edge = 0.5", 3),
    ("polygon", "points = 0 0, 3 0, 3 1, 1 1, 1 3, 0 3", 2),
    ("polygon", "order = 6; radius = 2; height = 2", 3),
    ("strip", "length = 3, 4, 1", 3),
]


@pytest.mark.parametrize(("shape", "sizes", "dimensions"), SHAPES)
def test_volumes_of_spaces_are_those_of_what_is_inside(shape, sizes, dimensions):
    space = make_space(shape, [settings_with(sizes)], dimensions)
    generator, count = np.random.default_rng(3), 200_000
    places = space.middle + space.half * generator.uniform(-1.2, 1.2, (count, 3))
    around = float(np.prod(2.4 * space.half[:dimensions]))
    inside = space.inside(places)
    if space.edges:
        # What repeats has no end of its own.
        inside &= np.all(np.abs(places - space.middle) <= space.half, axis=-1)
    share = float(np.mean(inside))
    error = around * math.sqrt(share * (1 - share) / count)
    assert abs(around * share - space.volume) < 4 * error
    assert error < 0.01 * space.volume
    drawn = np.array([space.draw(generator) for _ in range(200)])
    assert np.all(space.inside(drawn))


THIN = [
    ("square", "length = 20, 0, 0", "on", (0, 1, 1)),
    ("sphere", "radius = 0", "point", (1, 1, 1)),
    ("capsule", "length = 20; radius = 0", "on", (0, 1, 1)),
    ("cylinder", "length = 0; radius = 5", "on", (1, 0, 0)),
    ("cylinderZ", "bottom = 0; top = 0; radius = 0", "inside", (1, 1, 1)),
]


@pytest.mark.parametrize(("shape", "sizes", "mode", "held"), THIN)
def test_planes_lines_and_points_hold_bodies_with_their_stiffness(tmp_path, shape, sizes, mode, held):
    """Equipartition across a space that has no width, of 60 beads at 12 times; along it they go where they like."""
    cell = f"set space rail {{ shape = {shape} }}\nnew rail {{ {sizes} }}\n"
    text = f"set bead ball {{ confine = {mode}, 1 }}\nnew 60 ball {{ radius = 0.05; position = ball 1 }}\n"
    found, document = translated(tmp_path, text, SYSTEM.replace("time_step = 0.001", "time_step = 0.005"), cell)
    assert document.missing == [] and "has a thickness of 0.2 nm" in document.text()
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    squares = []
    for _ in range(13):
        # Three times the relaxation of 6 pi eta R/k.
        simulation.step(300)
        positions = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value
        squares.append(positions[[own[0] for own in built.filaments.body_indices]] ** 2)
    squares = np.array(squares[1:])
    expected = 0.0042 / 1.0 * 1e6
    for axis in np.flatnonzero(held):
        error = expected * math.sqrt(2.0 / squares[..., axis].size)
        assert error < 0.06 * expected
        assert abs(squares[..., axis].mean() - expected) < 4 * error
    assert np.all(squares.mean(axis=(0, 1))[np.flatnonzero(np.logical_not(held))] > 2 * expected)


def test_unknown_places_and_directions_are_said(tmp_path):
    text = TUBE + "new 3 tube { length = 1; position = moebius 3 }\nnew tube { length = 1; direction = sideways }\n"
    _, document = translated(tmp_path, text)
    assert document.missing == ["positions: moebius", "directions: sideways"]


def test_what_a_run_refuses_is_said_with_the_line_of_cytosims_file(tmp_path):
    path = tmp_path / "my.cym"
    path.write_text(SYSTEM + CELL + TUBE + "new tube { length = 3 }\n" + RUN)
    translation = translate(path, "my")
    text = translation.document.text().replace('"kratky-porod"', '"bent"')
    with pytest.raises(InputError, match=r"my.cym, line 5: what becomes of this cannot be run: .*bending_model"):
        check(translation, text, path)
