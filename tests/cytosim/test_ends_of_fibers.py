"""What ends of fibers and hands at them become: laws of ``src/sim/fibers`` and ``src/sim/hands`` of Cytosim."""

import numpy as np
import pytest

from support.cytosim_files import MICROMETER, SECOND, TUBE, translated

CLASSIC = "set fiber tube { rigidity = 20; activity = classic; growing_speed = 0.2, 0.1; shrinking_speed = -0.4, -0.3; "


def turning_ends(tmp_path, keys, state="end_state = grow, grow"):
    found, document = translated(tmp_path, f"{CLASSIC}{keys} }}\nnew tube {{ length = 2; {state} }}\n")
    assert document.missing == []
    return found.filaments[0].growth


def test_catastrophes_of_both_ends_have_the_rates_of_cytosim(tmp_path):
    """Free ends, and those whose growth is blocked: add = 0 in ``src/sim/fibers/classic_fiber.cc``."""
    growth = turning_ends(
        tmp_path, "catastrophe_rate = 0.02, 0.03; catastrophe_rate_stalled = 0.4, 0.2; rescue_rate = 0.1, 0.5"
    )
    length = growth.monomers.length
    for turning, rates in (
        (growth.plus_instability, (0.02, 0.4, 0.1, 0.4)),
        (growth.minus_instability, (0.03, 0.2, 0.5, 0.3)),
    ):
        own = turning.catastrophe_rate, turning.blocked_catastrophe_rate, turning.rescue_rate
        assert own == pytest.approx(tuple(rate / SECOND for rate in rates[:3]))
        assert turning.shrinking_off_rate * length == pytest.approx(rates[3] * MICROMETER / SECOND)


@pytest.mark.parametrize(
    ("keys", "blocked"),
    [
        ("catastrophe_rate = 0.02; catastrophe_rate_stalled = 0.4", 0.4),
        # As files before 2014 have it, with one growing_force.
        ("catastrophe_rate = 0.02, 0.3; growing_force = 2", 0.3),
        ("catastrophe_rate = 0.02; catastrophe_rate_stalled = 0.02", None),
        # A stalled rate alone means nothing there.
        ("catastrophe_rate = 0; catastrophe_rate_stalled = 0.4", None),
        # As many as monomers come: 0.2 um/s in steps of 8 nm or so.
        ("catastrophe_rate = 1; catastrophe_rate_stalled = 100", 1 + 0.2 / 0.008),
    ],
)
def test_blocked_catastrophes(tmp_path, keys, blocked):
    growth = turning_ends(tmp_path, keys, "plus_end = grow; minus_end = static")
    found = growth.plus_instability.blocked_catastrophe_rate
    assert found == (None if blocked is None else pytest.approx(blocked / SECOND, rel=0.02)) and growth.minus_capped
    assert growth.plus_instability.catastrophe_length is None


def test_catastrophes_in_proportion_to_lengths(tmp_path):
    growth = turning_ends(tmp_path, "catastrophe_rate = 0.02; catastrophe_length = 5", "plus_end = grow")
    assert growth.plus_instability.catastrophe_length == 5000.0


def test_ends_that_begin_by_shrinking(tmp_path):
    keys = "catastrophe_rate = 0.02; catastrophe_rate_stalled = 0.4; rescue_rate = 0.1"
    growth = turning_ends(tmp_path, keys, "plus_end = shrink")
    states, length = growth.states("plus"), growth.monomers.length
    assert states.names == ("shrinking", "growing") and growth.vanishes
    np.testing.assert_allclose(np.array(states.switch_rates) * SECOND, [[0, 0.1], [0.02, 0]])
    np.testing.assert_allclose(np.array(states.blocked_switch_rates) * SECOND, [[0, 0], [0.38, 0]])
    assert states.on_rates[0] == 0.0 and states.off_rates[1] == 0.0
    assert states.off_rates[0] * length == pytest.approx(0.4 * MICROMETER / SECOND)
    assert states.on_rates[1] * growth.pool.concentration * length == pytest.approx(0.2 * MICROMETER / SECOND)


@pytest.mark.parametrize(
    ("keys", "plus", "minus"),
    [
        ("catastrophe_rate = 0.02; rescue_rate = 0.1; rebirth_rate = 3", 3.1, None),
        ("catastrophe_rate = 0.02, 0.03; rescue_rate = 0.1, 0.5; rebirth_rate = 3, 4", 3.1, 4.5),
        ("catastrophe_rate = 0.02; rebirth_rate = inf", 10 / 0.001, None),
    ],
)
def test_fibers_begin_anew_at_the_shortest_length(tmp_path, keys, plus, minus):
    """Beside rescues there, as mStateP in ``src/sim/fibers/classic_fiber.cc``; those that are deleted do not."""
    growth = turning_ends(tmp_path, f"{keys}; persistent = 1; min_length = 0.5", "end_state = grow, grow")
    found = growth.plus_instability.renucleation_rate * SECOND
    assert found == pytest.approx(plus) and not growth.vanishes and growth.shortest == pytest.approx(500.0)
    if minus is not None:
        assert growth.minus_instability.renucleation_rate * SECOND == pytest.approx(minus)
    shrinking = turning_ends(tmp_path, f"{keys}; persistent = 1", "plus_end = shrink").states("plus")
    more = plus - (0.1 if "rescue" in keys else 0.0)
    np.testing.assert_allclose(np.array(shrinking.shortest_switch_rates) * SECOND, [[0, more], [0, 0]])
    deleted = turning_ends(tmp_path, keys).plus_instability
    assert deleted.renucleation_rate is None


def test_fibers_with_caps_begin_anew_at_the_shortest_length(tmp_path):
    tube = "set fiber tube { rigidity = 20; activity = dynamic; growing_speed = 0.2; shrinking_speed = -0.4; "
    tube += "hydrolysis_rate = 0.5; persistent = 1; rebirth_rate = 2 }\nnew tube { length = 2; plus_end = grow }\n"
    found, document = translated(tmp_path, tube)
    assert document.missing == []
    assert found.filaments[0].growth.plus_instability.renucleation_rate * SECOND == pytest.approx(2.0)
    assert "a unit would come off" in document.text()


def single(
    hand, fiber="set fiber tube { rigidity = 20; activity = grow; growing_speed = 0.5 }\n", made="plus_end = grow"
):
    text = fiber + f"set hand own {{ binding = 3, 0.02; unbinding = 0.2; {hand} }}\n"
    text += "set single free { hand = own; stiffness = 10; diffusion = fast }\n"
    return text + f"new 4 tube {{ length = 2; {made} }}\nnew 9 free\n"


def test_hands_that_cut(tmp_path):
    cut = "activity = cut; cutting_rate = 0.7; new_end_state = grow, static"
    found, document = translated(tmp_path, single(cut))
    hand, idle = found.linkers[0].kind.hands
    assert hand.severing_rate == pytest.approx(0.7 / SECOND) and idle.severing_rate == 0.0
    assert [group.count for group in found.filaments if group.is_reserve] == [80] and document.missing == []
    assert found.filaments[0].growth.severing.rate == 0.0
    # Fibers that have no dynamics are cut, too.
    found, document = translated(tmp_path, single("activity = cut; cutting_rate = 0.7", TUBE, ""))
    growth = found.filaments[0].growth
    assert growth.plus_capped and growth.minus_capped and not growth.vanishes and document.missing == []
    _, document = translated(tmp_path, single(cut.replace("grow", "shrink")))
    assert document.missing == ["growth: states of new ends"]


def test_hands_at_ends(tmp_path):
    track = "activity = track; track_end = plus_end; bind_only_end = plus_end, 0.5"
    found, document = translated(tmp_path, single(track))
    own = found.linkers[0].kind.hands[0].filament_end
    assert (own.end, own.range, own.binds_there, own.tracks) == ("plus", 500.0, True, True)
    assert document.missing == []
    for options in ({}, {"fiber": TUBE, "made": ""}):
        found, document = translated(
            tmp_path, single("bind_only_end = both_ends; bind_end_range = 0.01; activity = track", **options)
        )
        own = found.linkers[0].kind.hands[0].binding_range
        assert (own.end, own.range, own.excluded) == ("both", 10.0, False) and document.missing == []
    found, document = translated(tmp_path, single("hold_shrinking_end = 1"))
    assert found.linkers[0].kind.hands[0].at_end == "hold" and document.missing == []
    motor = "activity = move; speed = 0.8; hold_growing_end = 1; hold_shrinking_end = 1"
    found, document = translated(tmp_path, single(motor))
    hand = found.linkers[0].kind.hands[0]
    assert hand.at_end == "hold" and hand.filament_end.tracks and not hand.filament_end.binds_there
    assert document.missing == []
    for hand, options in (
        (track, {"fiber": TUBE, "made": ""}),
        ("bind_only_end = center, 0.1", {}),
        ("bind_only_end = plus_end; bind_only_free_end = 1", {}),
        ("activity = move; speed = 0.8; hold_growing_end = 0.9", {}),
    ):
        _, document = translated(tmp_path, single(hand, **options))
        assert document.missing == ["hands near ends"]
    # 40 steps per second, of which one in a thousand lets go: 0.04/s, less than 0.2/s.
    seldom = "activity = walk; step_size = 0.02; speed = 0.8; hold_growing_end = 0.999"
    found, document = translated(tmp_path, single(seldom))
    assert found.linkers[0].kind.hands[0].at_end == "hold" and document.missing == []


def chewing(tmp_path, of_fibers, of_hands=""):
    fiber = f"{CLASSIC}catastrophe_rate = 0.1; {of_fibers} }}\nnew 2 tube {{ length = 2; end_state = grow, static }}\n"
    hand = "set hand eater { binding = 10, 0.05; unbinding = 1; activity = chew; diffusion = 0.025; "
    hand += f"chewing_speed = 0.04; hold_growing_end = 1; {of_hands} }}\n"
    own = "set single cutter { hand = eater; stiffness = 100; activity = fixed }\nnew 5 cutter { position = ball 1 }\n"
    return translated(tmp_path, fiber + hand + own)


def test_hands_that_chew_take_monomers_off_both_ends(tmp_path):
    """At chewing_speed over the length of a monomer each, as long as all at an end do not exceed max_chewing_speed."""
    found, document = chewing(tmp_path, "max_chewing_speed = 0.12")
    assert document.missing == []
    hand = found.linkers[0].kind.hands[-1]
    length = found.filaments[0].growth.monomers.length
    at_end = hand.filament_end
    assert (at_end.end, at_end.tracks, at_end.sites) == ("both", True, 3)
    assert at_end.off_rate * length == pytest.approx(0.04 * MICROMETER / SECOND)
    # k_B T over the diffusion coefficient, in pN s/um.
    assert hand.sliding_friction == pytest.approx(0.0042 / 0.025 * 0.602214076 * SECOND / MICROMETER)


def test_hands_that_chew_no_fiber_are_said(tmp_path):
    found, document = chewing(tmp_path, "")
    assert document.missing == [] and found.linkers[0].kind.hands[-1].filament_end.off_rate == 0.0
    _, document = chewing(tmp_path, "max_chewing_speed = 0.12", "hold_growing_end = 0")
    assert "hands: chew" in document.missing
