"""Twist of filaments in a CylinderChainForce."""

import numpy as np
import openmm

from ..engine_choice import load_plugin
from ..errors import InputError
from ..filaments.twist import FILAMENT_ENDS


def set_end_frame(force, filament, frame):
    """Give a CylinderChainForce the frame beyond an end of a Filament: an EndFrame.

    Half a segment of material is between the frame of the last segment and an end that is held.
    """
    held = frame.torque is None
    force.setEndFrame(
        frame.filament,
        FILAMENT_ENDS.index(frame.end),
        openmm.Vec3(*frame.direction),
        2.0 * filament.type.twist_stiffness if held else 0.0,
        0.0 if held else frame.torque,
        frame.angular_velocity,
    )


def twists_of(context, number):
    """Twists in radians of a filament in a Context, those to the frames of its ends among them."""
    return np.array(_chain_force(context).getTwists(context, number))


def set_twists_of(context, number, twists):
    """Give a filament in a Context other twists."""
    _chain_force(context).setTwists(context, number, np.asarray(twists, dtype=float).tolist())


def _chain_force(context):
    plugin = load_plugin()
    for force in context.getSystem().getForces():
        if plugin.CylinderChainForce.isinstance(force):
            return plugin.CylinderChainForce.cast(force)
    raise InputError("The Context is none of a System with filaments.")
