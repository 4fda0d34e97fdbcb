"""Twist of filaments in a CylinderChainForce."""

import numpy as np
import openmm

from ..engine_choice import load_plugin
from ..errors import InputError
from ..filaments.twist import FILAMENT_ENDS


def set_end_frame(force, filament, frame, bodies):
    """Give a CylinderChainForce, with its PlacedBodies, the frame beyond an end of a Filament: an EndFrame.

    Half a segment of material is between the frame of the last segment and one that is held, or has a friction.
    """
    has_joint = frame.is_held or frame.rotational_friction is not None
    place = frame.filament, FILAMENT_ENDS.index(frame.end)
    direction = np.array(frame.direction)
    if frame.body is not None and not bodies[frame.body].planar:
        # The frames of planar bodies are not turned as they begin.
        direction = bodies[frame.body].rotation.T @ direction
    force.setEndFrame(
        *place,
        openmm.Vec3(*direction),
        2.0 * filament.type.twist_stiffness if has_joint else 0.0,
        frame.torque or 0.0,
        frame.angular_velocity,
        frame.rotational_friction or 0.0,
    )
    if frame.body is not None:
        force.setEndFrameBody(*place, frame.body)


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
