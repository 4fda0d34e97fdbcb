"""The forces of filaments in the portable engine: stock forces of OpenMM, and a PythonForce that propels."""

import numpy as np
import openmm

from ..mechanics.potentials import (
    BENDING_POTENTIALS,
    BOND_DIFFERENCE,
    BOND_DIFFERENCE_EXPRESSION,
    STRETCHING_POTENTIALS,
)

STRETCHING_NAME = "CylinderChainStretching"
BENDING_NAME = "CylinderChainBending"
TETHER_NAME = "CylinderChainTethers"
PROPULSION_NAME = "CylinderChainPropulsion"


def add_stretching_forces(system, segments, force_group):
    """Add one CustomBondForce for each stretching model in use.

    Segments are (ChainType, particle, particle, stiffness, rest length).
    """
    forces = {}
    for filament_type, minus, plus, stiffness, rest_length in segments:
        model = filament_type.stretching_model
        values = [stiffness, rest_length]
        names = ["stretching_stiffness", "rest_length"]
        if filament_type.maximum_extension is not None:
            values.append(filament_type.maximum_extension)
            names.append("maximum_extension")
        if model not in forces:
            forces[model] = _named_force(
                openmm.CustomBondForce(STRETCHING_POTENTIALS[model].expression), STRETCHING_NAME, model, force_group
            )
            for name in names:
                forces[model].addPerBondParameter(name)
        forces[model].addBond(minus, plus, values)
    for force in forces.values():
        system.addForce(force)


def add_bending_forces(system, joints, force_group):
    """Add one force for each bending model in use: a CustomAngleForce, or a CustomCompoundBondForce of beads.

    Joints are (ChainType, particle, particle, particle, stiffness).
    """
    forces = {}
    for filament_type, before, joint, after, stiffness in joints:
        if filament_type.bending_rigidity == 0.0:
            continue
        model = filament_type.bending_model
        if model not in forces:
            forces[model] = _named_force(_bending_force(model), BENDING_NAME, model, force_group)
        if model == BOND_DIFFERENCE:
            forces[model].addBond([before, joint, after], [stiffness])
        else:
            forces[model].addAngle(before, joint, after, [stiffness])
    for force in forces.values():
        system.addForce(force)


def _bending_force(model):
    if model == BOND_DIFFERENCE:
        force = openmm.CustomCompoundBondForce(3, BOND_DIFFERENCE_EXPRESSION)
        force.addPerBondParameter("bending_stiffness")
    else:
        force = openmm.CustomAngleForce(BENDING_POTENTIALS[model].expression)
        force.addPerAngleParameter("bending_stiffness")
    return force


def add_propulsion(system, filaments, node_indices, force_group):
    """Add one PythonForce for all self-propelled filaments: no other kind of force may lack an energy."""
    minus, plus, propulsion = [], [], []
    for filament, indices in zip(filaments, node_indices):
        if filament.propulsion:
            minus.append(indices[: filament.segments])
            plus.append(np.roll(indices, -1)[: filament.segments])
            propulsion.append(np.full(filament.segments, filament.propulsion))
    force = openmm.PythonForce(Propulsion(*map(np.concatenate, (minus, plus, propulsion))))
    force.setName(PROPULSION_NAME)
    force.setForceGroup(force_group)
    system.addForce(force)


class Propulsion:
    """The computation of a PythonForce: a force F0 t on every segment of self-propelled filaments.

    The particles of the ends of segments (segments,), and F0 (segments,) in kJ/(mol nm).
    """

    def __init__(self, minus, plus, propulsion):
        self._minus = minus
        self._plus = plus
        self._propulsion = propulsion

    def __call__(self, state):
        positions = state.getPositions(asNumpy=True)._value
        vectors = positions[self._plus] - positions[self._minus]
        half = (0.5 * self._propulsion / np.linalg.norm(vectors, axis=1))[:, None] * vectors
        forces = np.zeros_like(positions)
        # A node is the minus end of one segment at most, and the plus end of one.
        forces[self._minus] += half
        forces[self._plus] += half
        return 0.0, forces


def add_tethers(system, placed, force_group):
    """Add one CustomExternalForce for all tethers."""
    force = openmm.CustomExternalForce("0.5*tether_stiffness*((x-tether_x)^2+(y-tether_y)^2+(z-tether_z)^2)")
    for name in ("tether_x", "tether_y", "tether_z", "tether_stiffness"):
        force.addPerParticleParameter(name)
    force.setName(TETHER_NAME)
    force.setForceGroup(force_group)
    for tether in placed.tethers:
        force.addParticle(int(placed.node_indices[tether.filament][tether.node]), [*tether.point, tether.stiffness])
    system.addForce(force)


def set_tethers(force, placed, tethers):
    """Give the force of the tethers others, by their numbers."""
    for number, tether in tethers.items():
        node = int(placed.node_indices[tether.filament][tether.node])
        force.setParticleParameters(number, node, [*tether.point, tether.stiffness])


def _named_force(force, name, model, force_group):
    force.setName(f"{name} ({model})")
    force.setForceGroup(force_group)
    return force
