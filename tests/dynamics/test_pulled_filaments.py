"""Warnings of segments that are too long for the force that pulls them."""

import warnings

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import DSDNA, Filaments, SegmentLengthWarning, constant_force, constant_tension, theory

PICONEWTON = unit.piconewton


def messages(kind, force=None, tension=None, stretch=None, temperature=310.0, clamped=(0,), segments=12):
    """Of a filament that is clamped at one end and pulled at the other, or pulled at both, or held at a distance."""
    filaments = Filaments(0.69e-3 * unit.pascal * unit.second, temperature)
    filaments.add_equilibrium(kind, segments, seed=1, start=[0, 0, 0], direction=[1, 0, 0], clamped=clamped)
    if stretch is not None:
        filaments.add_tether(0, -1, [stretch * segments * kind.segment_length, 0, 0], 0.1 * PICONEWTON / unit.nanometer)
    _, system, _ = filaments.build()
    if force is not None:
        system.addForce(constant_force([filaments.node_indices[0][-1]], np.array(force) * PICONEWTON))
    if tension is not None:
        system.addForce(constant_tension(filaments, tension * PICONEWTON, [1, 0, 0]))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SegmentLengthWarning)
        filaments.create_integrator(system, 1e-3)
    return [str(one.message) for one in caught if issubclass(one.category, SegmentLengthWarning)]


def test_filaments_that_are_pulled():
    (message,) = messages(DSDNA, force=[0, 20, 0])
    assert message.startswith("Filament 0 (DNA) is pulled with 20 pN, under which a wormlike chain bends over")
    assert "= 3.04 nm. In segments of 8 nm" in message
    assert "at 0.65 of the force" in message and "theory.calibrated_up_to_force" in message
    assert messages(DSDNA, tension=20, clamped=()) == [message]
    assert "pulled with 20 pN" in messages(DSDNA, tension=20)[0]


def test_pulls_that_are_right():
    """A weak force, one that presses, one up to which segments are calibrated."""
    assert messages(DSDNA, force=[1, 0, 0]) == []
    assert messages(DSDNA, tension=-20, clamped=()) == []
    fine = theory.calibrated_up_to_force(DSDNA.with_segment_length(4), 20 * PICONEWTON, 310)
    assert messages(fine, force=[5, 0, 0]) == messages(fine, force=[20, 0, 0]) == []
    assert "with 40 pN, but calibrated up to 20 pN" in messages(fine, force=[40, 0, 0])[0]
    # Only cut, they lengthen by their own fluctuations.
    assert "at 0.80 of the force" in messages(DSDNA.with_segment_length(1), force=[20, 0, 0])[0]


def test_filaments_that_are_held_at_a_distance():
    """The trap of 0.1 pN/nm and a wormlike chain share it."""
    (message,) = messages(DSDNA, stretch=1.2)
    force = float(message.split("pulled with ")[1].split(" pN")[0])
    distance = 1.2 * 96.0
    chain = 96.0 * theory.wlc_relative_extension(force * PICONEWTON, 43.3, 310.0, 1100 * PICONEWTON)
    assert chain + force / 0.1 == pytest.approx(distance, rel=0.01)
    assert messages(DSDNA, stretch=0.8) == []
    assert messages(DSDNA, stretch=1.2, clamped=()) == []


@pytest.mark.slow
def test_calibrated_dna_has_the_extension_of_the_wormlike_chain():
    """In the middle of chains of 4 nm under 20 pN, at the recommended step; one per cent of the force is allowed."""
    force, segments, middle = 20.0, 16, slice(4, 13)
    kind = theory.calibrated_up_to_force(DSDNA.with_segment_length(4), force * PICONEWTON, 310)
    filaments = Filaments(0.69e-3 * unit.pascal * unit.second, 310)
    for number in range(100):
        filaments.add_straight(kind, segments, [0, 30.0 * number, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    system.addForce(constant_tension(filaments, force * PICONEWTON, [1, 0, 0]))
    step = filaments.recommended_time_step(system=system).step
    integrator = filaments.create_integrator(system, step, random_seed=1)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("CPU"))
    context.setPositions(positions)
    lengths = []
    for frame in range(600):
        integrator.step(20)
        x = context.getState(positions=True).getPositions(asNumpy=True)._value[:, 0].reshape(100, segments + 1)
        if frame >= 100:
            lengths.append((x[:, middle.stop - 1] - x[:, middle.start]) / (4 * (middle.stop - 1 - middle.start)))
    own = np.mean(lengths, axis=0)
    error = own.std(ddof=1) / 10
    lower, exact, upper = theory.wlc_relative_extension(
        np.array([0.99, 1.0, 1.01]) * force * PICONEWTON, 43.3, 310, 1100 * PICONEWTON
    )
    assert error < 0.4 * (upper - lower)
    assert lower - 4 * error < own.mean() < upper + 4 * error
    plain = theory.long_chain_extension(DSDNA.with_segment_length(4), force * PICONEWTON, 310) / 4
    assert abs(plain - exact) > 8 * error
