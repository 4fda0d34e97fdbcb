"""Turns that filaments with twist lose where strands pass through each other: runs warn of them."""

import warnings

import numpy as np
import pytest

from openmm_cylchain import Filaments, TwistWarning
from openmm_cylchain.runs.lost_turns import LostTurns
from support.contexts import new_context, positions_of
from support.solvent import TEMPERATURE, VISCOSITY
from support.twisted_chains import DNA

RING = 24


def figure_of_eight(height):
    """A ring of which one strand crosses another at twice a height, above it or below."""
    angles = 2 * np.pi * np.arange(RING) / RING + 0.1
    return np.stack([30 * np.sin(angles), 15 * np.sin(2 * angles), height * np.cos(angles)], axis=1)


def in_context(velocity=0.0):
    """A ring, and a filament whose plus end turns at an angular velocity, in a Context; and LostTurns of them."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_ring(DNA, RING, [0, 0, 0])
    filaments.add_straight(DNA, 8, [100, 0, 0], [0, 0, 1], clamped=[0, 1, 7, 8])
    filaments.add_end_frame(1, "minus", [0, 0, 1])
    filaments.add_end_frame(1, "plus", [0, 0, 1], angular_velocity=velocity)
    filaments.add_straight(DNA, 8, [200, 0, 0], [0, 0, 1])
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1e3, random_seed=1, checks=False)
    return filaments, new_context(system, positions, integrator, "CPU"), LostTurns(filaments)


def test_strands_that_pass_are_warned_of():
    filaments, context, turns = in_context()
    positions = positions_of(context)
    for height in (5.0, -5.0):
        positions[filaments.node_indices[0]] = figure_of_eight(height)
        context.setPositions(positions)
        if height > 0:
            turns.look(context)
    with pytest.warns(TwistWarning, match=r"Filament 0 \(DNA\) has lost 1\.\d turns") as caught:
        turns.look(context)
    assert len(caught) == 1


def test_ends_that_lose_a_turn_are_warned_of():
    """Of the filament that is held: not where it is turned as it is told, by six turns."""
    filaments, context, turns = in_context(velocity=2 * np.pi * 1e-5)
    own = filaments.in_context(context)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(6):
            turns.look(context)
            context.getIntegrator().step(100)
        turns.look(context)
    assert own.linking_number(1) == pytest.approx(6.0, abs=0.01)
    own.turn_end(1, "plus", -2.4 * np.pi)
    with pytest.warns(TwistWarning, match=r"Filament 1 \(DNA\) has lost 1\.2 turns"):
        turns.look(context)
