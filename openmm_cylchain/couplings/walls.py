"""Walls that confine filaments.

A wall pushes back what is beyond it, with the energy ``(k/2) d^2`` for the depth d to which a particle has got in.
``wall_force`` is for every engine and platform, ``filament_wall_force`` for steps that walls do not limit.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import openmm

from ..engine_choice import available_engines, choose_engine
from ..errors import InputError
from ..filaments.collection import FilamentCollection, held_numbers, require_filaments
from ..units.quantities import LENGTH, STIFFNESS, in_units_of, one_of, positive, shown, whole_numbers
from ..units.types import FloatArray, Indices, Numbers, Scalar
from .contacts import outside_particles
from .shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Shape, Slab, Sphere, Torus, number

WALL_NAME = "Wall"

SIDES = ("inside", "outside", "surface")
"""Where a wall keeps filaments."""

NODES: dict[str, Any] = {"all": slice(None), "ends": [0, -1], "first": slice(1), "last": slice(-1, None)}
"""Which of their nodes it holds, by names."""


def wall_force(shape: Shape, stiffness: Scalar, particles: Indices) -> openmm.CustomExternalForce:
    """A CustomExternalForce with the energy (k/2) d^2 of each particle, for its depth d beyond a wall.

    It is explicit in every scheme: ``Filaments.recommended_time_step(system=system)`` says which step it allows.
    ``filament_wall_force`` makes walls that implicit schemes have in their equations.

    Parameters
    ----------
    shape : Shape
    stiffness : energy/length^2
    particles : sequence of int
        Particle indices, of nodes, attachment points or anything else.

    Returns
    -------
    openmm.CustomExternalForce
        To be added to the System.

    Raises
    ------
    InputError
        For a shape that is none, or a stiffness that is not positive.
    """
    if not isinstance(shape, Shape):
        raise InputError(f"shape must be a Shape such as Sphere, but is {shown(shape)}.")
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    square_depth, *definitions = shape.expression.split(";", 1)
    expression = ";".join([f"{number(0.5 * stiffness)}*({square_depth})", *definitions])
    force = openmm.CustomExternalForce(expression)
    force.setName(f"{WALL_NAME} ({type(shape).__name__.lower()})")
    for particle in whole_numbers(particles, 0, "particles"):
        force.addParticle(particle, [])
    return force


def filament_wall_force(
    filaments: FilamentCollection,
    system: openmm.System,
    shape: Shape,
    stiffness: Scalar,
    radius: Numbers = 0.0,
    particles: Indices = (),
    particle_radius: Numbers = 0.0,
    numbers: Indices | None = None,
    side: str = "inside",
    nodes: str = "all",
) -> Any:
    """A wall around the nodes of filaments, which implicit schemes have in their equations.

    Of a filament of beam elements, it is around its beads, which are places on its curve (``Filaments.add_beads``), or
    around its nodes if it has none. The energy is ``(k/2) d^2`` for the depth d to which a node, or a sphere around it,
    gets beyond the wall: that of ``wall_force`` at a radius of zero. Scheme "implicit" has the wall in its equations:
    its stiffness does not limit the step. Scheme "implicit-second-order" refuses it. In other schemes, and in other
    Integrators, it is explicit.

    With ``side="outside"``, nodes are kept outside of the shape, with the depth to which they get into it. With
    ``side="surface"``, they are held on its surface from both sides, with the energy ``(k/2) d^2`` for the signed depth
    d of what has the radius around a node: nodes are a radius inside. Both are for shapes with one face: not for slabs
    and boxes.

    Parameters
    ----------
    filaments : Filaments
        In the System.
    system : openmm.System
        The force is not added to it.
    shape : Shape
    stiffness : energy/length^2
        k. A node gets ``(k_BT/k)^(1/2)`` beyond the wall.
    radius : length, or array of lengths, one for each filament that the wall holds
        Distance from the wall that axes of filaments keep, such as half their diameter.
    particles : sequence of int
        Particles outside filaments that the wall keeps in, too.
    particle_radius : length, or array of lengths, one for each of ``particles``
    numbers : sequence of int, optional
        Of the filaments that the wall holds; others go through it. All of them if not given.
    side : {"inside", "outside", "surface"}
        Where nodes are kept.
    nodes : {"all", "ends", "first", "last"}
        Which nodes, or beads, of each filament are; others go through the wall. Filaments that grow need all.

    Returns
    -------
    CylinderChainWallForce
        To be added to the System. It works where the compiled engine does. ``setRegion``, ``setStiffness`` and
        ``updateParametersInContext`` move and change the wall.

    Raises
    ------
    InputError
        If the compiled engine is missing, for a shape that is none or does not have the side, a side or nodes that
        there are not, a stiffness that is not positive, a radius that is negative or does not fit in, a filament that
        does not exist, or a particle that does not or is one of the filaments'.
    """
    choose_engine("compiled")
    from .. import plugin

    if not isinstance(shape, Shape):
        raise InputError(f"shape must be a Shape such as Sphere, but is {shown(shape)}.")
    stiffness = positive(stiffness, STIFFNESS, "stiffness")
    require_filaments(filaments)
    held = held_numbers(numbers, len(filaments))
    one_of(side, SIDES, "side")
    one_of(nodes, NODES, "nodes")
    if side != "inside" and len(shape.faces) > 1:
        raise InputError(f'side must be "inside" of a {type(shape).__name__}, which has several faces.')
    room = np.inf if side == "outside" else shape.room
    radii = _radii(radius, len(held), "radius", room)
    spheres = outside_particles(filaments, system, particles)
    sphere_radii = _radii(particle_radius, len(spheres), "particle_radius", room)
    name, point, direction, length = shape.region
    force = plugin.CylinderChainWallForce(name, openmm.Vec3(*point), openmm.Vec3(*direction), length, stiffness)
    force.setSide(side)
    force.setName(
        f"CylinderChainWallForce ({name})" if side == "inside" else f"CylinderChainWallForce ({name}, {side})"
    )
    every, beads = filaments.node_indices, filaments.bead_indices
    for index, value in zip(held, radii):
        own = every[index], beads[index]
        places = np.array(filaments[index].type.segment_kind.particles_along(*own))
        if nodes != "all" and (filaments[index].closed or filaments[index].growth is not None):
            what = "is a ring, without ends" if filaments[index].closed else "grows"
            raise InputError(f'Filament {index} {what}: nodes must be "all", but is "{nodes}".')
        for place in places[NODES[nodes]]:
            force.addParticle(int(place), float(value))
    for particle, value in zip(spheres, sphere_radii):
        force.addParticle(int(particle), float(value))
    return force


def _radii(value, count, name, room):
    values = np.asarray(in_units_of(value, LENGTH, name))
    if values.ndim and values.shape != (count,):
        raise InputError(f"{name} must be a number or have {count} entries, but has the shape {values.shape}.")
    values = np.broadcast_to(values, (count,))
    if not np.all(values >= 0.0):
        raise InputError(f"{name} cannot be negative, but is {values.min():g}.")
    if not np.all(values < room):
        raise InputError(f"{name} must be below {room:g} nm to fit into the shape, but is {values.max():g}.")
    return values


def as_filament_wall_force(force: openmm.Force) -> Any | None:
    """A force as the CylinderChainWallForce that it is, or None if it is another one."""
    if available_engines()["compiled"] is not None:
        return None
    from .. import plugin

    if not plugin.CylinderChainWallForce.isinstance(force):
        return None
    return plugin.CylinderChainWallForce.cast(force)


def shape_of_wall(force: openmm.Force) -> tuple[Shape, float] | None:
    """The shape and the stiffness, in kJ/(mol nm^2), of a ``wall_force``; None of another force."""
    if not isinstance(force, openmm.CustomExternalForce):
        return None
    expression = force.getEnergyFunction()
    stiffness, *numbers = map(float, _NUMBER.findall(expression) or [0.0])
    for name, read in _READ.items():
        if force.getName() != f"{WALL_NAME} ({name})":
            continue
        try:
            shape = read(np.array(numbers))
        except (InputError, IndexError, ValueError):
            return None
        # Of another formula, numbers mean something else.
        alike = wall_force(shape, 2.0 * stiffness, []).getEnergyFunction()
        if _NUMBER.sub("", alike) == _NUMBER.sub("", expression):
            return shape, 2.0 * stiffness
    return None


# As number() writes them.
_NUMBER = re.compile(r"\((-?[0-9][-+.e0-9]*)\)")

# Shapes from the numbers in their formulas. There are two directions across an axis.
_READ: dict[str, Callable[[FloatArray], Shape]] = {
    "plane": lambda v: Plane(v[1:6:2], v[0:6:2]),
    "slab": lambda v: Slab(v[1:6:2], v[0:6:2], 2.0 * v[6]),
    "sphere": lambda v: Sphere(v[:3], v[3]),
    "cylinder": lambda v: Cylinder(v[1:6:2], np.cross(v[0:6:2], v[6:12:2]), v[12]),
    "capsule": lambda v: Capsule(v[1:6:2], v[12:18:2], 2.0 * v[18], v[19]),
    "torus": lambda v: Torus(v[1:6:2], v[13:19:2], v[12], v[19]),
    "box": lambda v: Box(v[0:6:2], v[1:6:2]),
    "ellipsoid": lambda v: Ellipsoid(v[1:7:2], v[2:7:2] ** -0.5),
}
