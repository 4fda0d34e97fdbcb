"""From a configuration to a System: filaments and particles where they begin, and all that acts on them.

It calls what users call from Python: methods of ``Filaments`` and ``Crosslinks``, ``capsule_contact_force`` and others.
"""

from dataclasses import dataclass, replace

import numpy as np
import openmm
from openmm import app, unit

from ..beams.curve import curve_points
from ..couplings.capsule_contacts import capsule_contact_force, contact_spacing
from ..couplings.planar_crossings import PlanarSegments
from ..couplings.pulling import constant_force, constant_tension
from ..couplings.walls import filament_wall_force, wall_force
from ..errors import InputError
from ..filaments import shapes
from ..filaments.monomers import Monomers
from ..output.progress import LateMessages, ProgressMessages
from ..systems.filaments import Filaments
from ..theory import chain_mean_square_end_to_end
from ..time_steps.recommended_step import recommended_time_step
from .errors_of_tables import located_errors
from .initial_bodies import add_bodies, add_holding_linkers, first_particles, spheres_of_bodies
from .initial_joints import add_joints
from .initial_links import add_links
from .keys import ConfigurationError

_ATTEMPTS, _NODES_OF_ATTEMPTS = 2000, 10**5
"""To place a filament within a region: how often, and how many nodes may be drawn for it if it is long."""
_POINTS_OF_ELEMENT = 8
"""By which the curve of a beam element is looked at."""


@dataclass(frozen=True)
class BuiltSystem:
    """Filaments in a System with all forces, and what their integrator needs; ``deleted`` are those that have gone."""

    filaments: Filaments
    topology: app.Topology
    system: openmm.System
    positions: unit.Quantity
    particle_friction: np.ndarray | None
    flow: object
    links: int
    deleted: frozenset = frozenset()

    def arguments(self):
        """Keyword arguments of ``create_integrator``, ``recommended_time_step`` and ``check_time_step``."""
        return {"particle_friction": self.particle_friction, "flow": self.flow}


@located_errors
def build_system(configuration, engine, seed, kinetics=True, begun=None, deleted=frozenset()):
    """The System of a configuration.

    Parameters
    ----------
    engine : {"compiled", "portable"} or None
    seed : int
        Of random places and shapes.
    kinetics : bool
        Whether to have linkers, and monomers that come and go.
    begun : Filaments, optional
        Whose initial positions are taken, in the place of drawn ones.
    deleted : frozenset of int
        Numbers of filaments that have gone.

    Returns
    -------
    BuiltSystem
    """
    filaments = place_filaments(configuration, engine, seed, kinetics, begun, deleted)
    topology, system, positions = filaments.build(box_vectors(configuration.box))
    positions, spheres, radii, friction = _add_particles(configuration, seed, topology, system, positions)
    in_contact = [group for group in configuration.bodies if group.contacts]
    touching, touching_radii = spheres_of_bodies(configuration, filaments, in_contact)
    count = add_links(configuration, filaments, system, seed)
    add_joints(configuration, filaments, system)
    tables = configuration.tables
    diameters = contact_diameters(configuration, filaments)
    if diameters or (configuration.contacts is not None and len(spheres) + len(touching) > 1):
        own = configuration.contacts
        with tables["contacts"][0].naming():
            force = capsule_contact_force(
                filaments,
                system,
                list(diameters.values()) if diameters else None,
                own.stiffness,
                [*spheres, *touching],
                2.0 * np.concatenate([radii, touching_radii]) if spheres or touching else None,
                own.excluded_neighbors,
                numbers=list(diameters),
            )
        system.addForce(force)
    names = [own.name for own in configuration.particles for _ in range(own.count)]
    of_walls = {entries.place.path[1]: entries for entries in tables["wall"]}
    for own in configuration.walls:
        entries = of_walls[own.number]
        held = [number for number, name in enumerate(names) if own.held_types is None or name in own.held_types]
        most = 1 if own.nodes == "first" else None
        bodies = [group for group in configuration.bodies if own.holds(group.body)]
        enclosed, enclosed_radii = spheres_of_bodies(configuration, filaments, bodies, most)
        every = [*(spheres[number] for number in held), *enclosed], np.concatenate([radii[held], enclosed_radii])
        with entries.naming():
            system.addForce(_wall(own, filaments, system, *every))
    for own, entries in zip(configuration.pulls, tables["pull"]):
        with entries.naming():
            system.addForce(_pull(own, filaments))
    return BuiltSystem(filaments, topology, system, positions, friction, configuration.flow, count, deleted)


def contact_diameters(configuration, filaments):
    """Those of filaments that are there and may touch others, in nm by their numbers."""
    every = (group.contact_diameter for group in configuration.filaments for _ in range(group.count))
    return {
        number: diameter
        for number, (own, diameter) in enumerate(zip(filaments, every))
        if own.takes_part and diameter is not None
    }


def stands_alone(configuration):
    """Whether nothing but the solvent at rest acts on filaments."""
    return not (
        configuration.linkers
        or configuration.links
        or configuration.joints
        or configuration.contacts
        or configuration.walls
        or configuration.pulls
        or configuration.tethers
        or configuration.end_frames
        or configuration.particles
        or configuration.bodies
        or configuration.flow
        or any(own.growth is not None for own in configuration.filaments)
    )


@located_errors
def recommended_step(configuration, scheme, engine, seed, built=None):
    """The TimeStep that is recommended for a configuration, whose simulation may still be None.

    ``built`` is its BuiltSystem, if there is one.
    """
    if stands_alone(configuration):
        # The same without building thousands of filaments.
        solvent = configuration.solvent.viscosity, configuration.solvent.temperature
        steps = (
            recommended_time_step(own.type, *solvent, scheme, own.segments, own.closed, propulsion=own.propulsion)
            for own in configuration.filaments
        )
        return min(steps, key=lambda step: step.step)
    if built is None:
        built = build_system(configuration, engine, seed)
    return built.filaments.recommended_time_step(scheme, system=built.system, **built.arguments())


def place_filaments(configuration, engine, seed, kinetics=True, begun=None, deleted=frozenset()):
    """Filaments with their initial positions, tethers and linkers.

    Filaments without a position are laid out side by side on a grid in the xy plane, centred on the origin, for the eye
    and for the digits of the single-precision trajectory. In a periodic box, their middles are at random places in it,
    and those that begin straight without a direction have random ones. With ``inside``, all of their nodes are in it.
    Planar filaments at random places that would cross others are drawn again, where there are contacts.

    Parameters
    ----------
    engine : {"compiled", "portable"} or None
    begun : Filaments, optional
        Whose positions are taken.
    deleted : frozenset of int
        Numbers of filaments that have gone; of those that grow, the state of a Context says so.

    Returns
    -------
    Filaments
    """
    solvent, box = configuration.solvent, configuration.box
    filaments = Filaments(solvent.viscosity, solvent.temperature, engine)
    on_bodies = add_bodies(configuration, filaments, seed)
    centers = _grid_centers(configuration.filaments, solvent.temperature) if box is None else None
    planar = PlanarSegments(box_vectors(box))
    messages = ProgressMessages()
    progress = LateMessages(
        messages,
        "filaments are placed: {} of {}",
        sum(own.count for own in configuration.filaments if not own.is_reserve),
    )
    for group in configuration.filaments:
        first = len(filaments)
        if group.is_reserve:
            _add_reserve(filaments, group, kinetics, configuration.tables)
            continue
        for index in range(group.count):
            progress.one_is_done()
            number = len(filaments)
            if begun is not None:
                _add(filaments, group, begun[number].positions, begun[number].control_points, kinetics)
                continue
            places = np.random.default_rng([seed, number, 1])
            crossed = planar if group.planar and group.contact_diameter is not None else None
            own = group, index, solvent.temperature, seed, number, places, box, centers
            if group.on_body:
                nodes, control_points = _on_body(group, *on_bodies[number], f"Filament {number}")
            else:
                nodes, control_points = _nodes(*own, crossed)
            if crossed is not None:
                crossed.add(number, nodes, group.closed)
            _add(filaments, group, nodes, control_points, kinetics)
        for number in range(first, len(filaments)):
            if not group.active or (number in deleted and group.growth is None):
                filaments.set_aside(number)
            if group.contact_diameter is not None and not group.type.segment_kind.straight:
                spacing = contact_spacing(group.type, group.contact_diameter, solvent.temperature)
                filaments.add_beads(number, spacing)
    messages.finish()
    for own, entries in zip(configuration.tethers, configuration.tables["tether"]):
        with entries.naming():
            for number in own.filaments:
                point = filaments[number].positions[own.node] if own.point is None else own.point
                filaments.add_tether(number, own.node, point, own.stiffness)
    for own, entries in zip(configuration.end_frames, configuration.tables["end_frame"]):
        with entries.naming():
            for number in own.filaments:
                filaments.add_end_frame(
                    number,
                    own.end,
                    own.direction,
                    torque=own.torque,
                    angular_velocity=own.angular_velocity,
                    rotational_friction=own.rotational_friction,
                    body=own.body,
                )
    for own, entries in zip(configuration.linkers if kinetics else (), configuration.tables["linkers"]):
        anchors = _anchors(own, configuration, filaments)
        # What is within reach of an anchor is known when overlaps have come apart: see ``relaxation``.
        later = anchors is not None and configuration.relaxes and own.bound_at is None
        with entries.naming():
            filaments.add_linkers(
                own.kind,
                own.count,
                concentration=own.concentration,
                volume=own.volume,
                anchors=anchors,
                bound=0 if later else own.bound,
                seed=seed,
                diffusion=own.diffusion,
                planar=own.planar,
                region=own.region,
                places=own.bound_at,
            )
    for barrier in configuration.barriers if kinetics else ():
        filaments.add_barrier(**vars(barrier))
    add_holding_linkers(configuration, filaments, seed)
    return filaments


def _anchors(own, configuration, filaments):
    if own.body_anchors is None:
        return None if own.anchors is None else np.array(own.anchors)
    table, points = own.body_anchors
    firsts = first_particles(configuration, filaments)
    before = sum(group.count for group in configuration.bodies[: table - 1])
    bodies = firsts[before : before + configuration.bodies[table - 1].count]
    return (bodies[:, None] + np.array(points)).ravel()


def box_vectors(box):
    """Vectors of a rectangular periodic box with three edges, or None if there is none."""
    return None if box is None else np.diag(box)


def _growth(group, kinetics):
    growth = group.growth
    if growth is not None and not kinetics:
        still = Monomers(length=growth.monomers.length)
        growth = replace(
            growth,
            monomers=still,
            plus_capped=False,
            plus_instability=None,
            minus_instability=None,
            severing=None,
        )
    return growth


def _add_reserve(filaments, group, kinetics, tables):
    name, index = group.path
    with tables[name][index].naming():
        filaments.add_reserve(
            group.type,
            group.count,
            growth=_growth(group, kinetics),
            nucleation=group.nucleation if kinetics else None,
            planar=group.planar,
            propulsion=group.propulsion,
        )


def _add(filaments, group, nodes, control_points, kinetics):
    filaments.add_nodes(
        group.type,
        nodes,
        control_points=control_points,
        closed=group.closed,
        clamped=group.clamped,
        clamped_tangents=group.clamped_tangents,
        planar=group.planar,
        propulsion=group.propulsion,
        growth=_growth(group, kinetics),
        rest_bends=group.rest_bends,
    )


def _nodes(group, index, temperature, seed, number, places, box, centers, planar):
    # Nodes and control points, which straight segments do not have.
    if group.positions is not None:
        controls = None if group.control_points is None else group.control_points[index]
        return _moved(group, (group.positions[index], controls), 0.0, 0.0)
    if group.inside is not None:
        return _inside(group, temperature, seed, number, places, planar)
    if box is not None and group.position is None:
        return _in_box(group, temperature, seed, number, places, box, planar)
    shape = _shape(group, temperature, seed, number, None if box is None else places)
    nodes, _ = shape
    if group.position is not None:
        shift = np.array(group.position) - (nodes.mean(axis=0) if group.closed else 0.0)
        return tuple(None if points is None else points + shift for points in shape)
    return _moved(group, shape, next(centers), nodes.mean(axis=0), group.height)


def _on_body(group, place, outward, end, label):
    # Straight along the radius, with its first or its last node at the place.
    length = float(group.type.segment_lengths(group.segments, False).sum())
    own = (place, outward) if end == "minus" else (place + length * outward, -outward)
    return shapes.straight(group.type, group.segments, *own, label)


def _in_box(group, temperature, seed, number, places, box, planar):
    attempts = 1 if planar is None else _attempts(group)
    for attempt in range(attempts):
        shape = _shape(group, temperature, seed, number, places, attempt)
        nodes, controls = _moved(group, shape, places.uniform(0.0, box), shape[0].mean(axis=0), group.height)
        if planar is None or planar.crossing(number, nodes, group.closed) is None:
            return nodes, controls
    raise ConfigurationError(
        f"{group.label}: planar filament {number} crosses another one, or itself, at each of "
        f"{attempts} random places. Take fewer or shorter filaments, another height or a larger box.",
        (*group.path, "planar"),
    )


def _moved(group, shape, to, middle, height=None):
    # Points of planar filaments have one z, to the bit.
    nodes, controls = (None if points is None else points + to - middle for points in shape)
    if group.planar:
        nodes[:, 2] = nodes[0, 2] if height is None else height
        if controls is not None:
            controls[:, 2] = nodes[0, 2]
    return nodes, controls


def _inside(group, temperature, seed, number, places, planar):
    attempts, crossed = _attempts(group), 0
    for attempt in range(attempts):
        shape = _shape(group, temperature, seed, number, places, attempt)
        nodes, controls = _moved(group, shape, group.inside.draw(places), shape[0].mean(axis=0), group.height)
        curve = nodes if controls is None else curve_points(nodes, controls, _POINTS_OF_ELEMENT, group.closed)
        if group.inside.contains(curve):
            if planar is None or planar.crossing(number, nodes, group.closed) is None:
                return nodes, controls
            crossed += 1
    reason = f"none of {attempts} random places has all of its nodes inside"
    if crossed:
        reason = f"at all {crossed} of {attempts} random places inside it crosses another planar filament, or itself"
    raise ConfigurationError(
        f"{group.label}: filament {number} of {group.segments} segments does not fit into its "
        f"region: {reason}. Take shorter filaments or a larger region.",
        (*group.path, "inside"),
    )


def _attempts(group):
    # One for a filament that fits nowhere: if it is straight, or even one of its segments is too long.
    if group.inside is not None and group.type.segment_kind.straight:
        shortest = group.segments if group.start == "straight" else 0.5
        if shortest * group.type.segment_length > group.inside.diameter:
            return 1
    return max(20, min(_ATTEMPTS, _NODES_OF_ATTEMPTS // group.nodes))


def _shape(group, temperature, seed, number, places, attempt=0):
    # Nodes with the first one at the origin, and control points. Each filament has a seed of its own.
    kind, origin, label = group.type, (0.0, 0.0, 0.0), f"Filament {number}"
    if group.closed:
        return shapes.ring(kind, group.segments, temperature, origin, group.normal, group.planar, label)
    direction = group.direction
    generator = np.random.default_rng([seed, number, *([2, attempt] if attempt else [])])
    if direction is not None and group.orientation == "nematic":
        direction = np.array(direction) * (1.0 if np.random.default_rng([seed, number, 3]).uniform() < 0.5 else -1.0)
    if group.start == "straight":
        if direction is None:
            direction = (1.0, 0.0, 0.0) if places is None else places.normal(size=3)
            if group.planar:
                direction = (*direction[:2], 0.0)
        return shapes.straight(kind, group.segments, origin, direction, label)
    own = origin, direction, group.clamped, group.planar, group.rest_bends, label
    return shapes.drawn(kind, group.segments, temperature, generator, *own)


def _grid_centers(groups, temperature):
    groups = [
        group
        for group in groups
        if group.position is None
        and group.inside is None
        and group.positions is None
        and not (group.is_reserve or group.on_body)
    ]
    count = sum(group.count for group in groups)
    spacing = 1.1 * max((_extent(group, temperature) for group in groups), default=0.0)
    columns = int(np.ceil(np.sqrt(count)))
    rows = int(np.ceil(count / max(columns, 1)))
    for number in range(count):
        row, column = divmod(number, columns)
        yield spacing * np.array([column - 0.5 * (columns - 1), 0.5 * (rows - 1) - row, 0.0])


def _extent(group, temperature):
    if group.closed:
        return group.segments * group.type.segment_length / np.pi
    if group.start == "straight":
        return group.segments * group.type.segment_length
    return np.sqrt(chain_mean_square_end_to_end(group.type, group.segments, temperature))


def _add_particles(configuration, seed, topology, system, positions):
    # Behind the filaments. All positions, the indices and radii of particles, and the friction of all that is no node:
    # none of beads on filaments, which are no particles of their own.
    everything, spheres, radii = [positions.value_in_unit(unit.nanometer)], [], []
    friction = [0.0] * sum(map(system.isVirtualSite, range(system.getNumParticles())))
    for number, own in enumerate(configuration.particles):
        chain = topology.addChain(f"P{number}")
        for place in range(own.count):
            topology.addAtom("P", None, topology.addResidue(own.name, chain, str(place + 1)))
            # Motion does not depend on a mass, except that those without one stay.
            spheres.append(system.addParticle(0.0 if own.fixed else 1.0))
            radii.append(0.5 * own.diameter)
            friction.append(own.friction)
        everything.append(own.places(np.random.default_rng([seed, number, 4]), configuration.box))
    return (
        np.concatenate(everything) * unit.nanometer,
        spheres,
        np.array(radii),
        np.array(friction) if spheres else None,
    )


def _wall(own, filaments, system, spheres, radii):
    numbers = [number for number, filament in enumerate(filaments) if filament.takes_part and own.holds(filament.type)]
    if filaments.engine == "compiled":
        radii = radii * own.whole
        for radius in radii:
            if own.side == "inside" and radius >= own.shape.room:
                raise InputError(f"a particle with a radius of {radius:g} nm does not fit into it.")
        return filament_wall_force(
            filaments,
            system,
            own.shape,
            own.stiffness,
            own.distance,
            spheres,
            radii if len(spheres) else 0.0,
            numbers,
            own.side,
            own.nodes,
        )
    nodes = [int(node) for number in numbers for node in filaments.node_indices[number]]
    return wall_force(own.shape, own.stiffness, [*nodes, *spheres])


def _pull(own, filaments):
    if own.force is None:
        return constant_tension(filaments, own.tension, own.direction, own.filaments)
    return constant_force([int(filaments.node_indices[number][own.node]) for number in own.filaments], own.force)
