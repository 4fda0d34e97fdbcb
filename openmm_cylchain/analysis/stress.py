"""The stress of a network: the virial of chains, linkers, crosslinks and contacts, and the ideal part of nodes."""

from dataclasses import dataclass

import numpy as np

from ..beams.curve import element_energies
from ..filaments.placement import joint_stiffnesses
from ..mechanics.geometry import segment_vectors
from ..units.quantities import thermal_energy
from ..units.types import FloatArray, Scalar
from .runs import Run, volume_of

# Of the strains whose differences of energy are the virial of beam elements; the error is of their fourth order.
_STRAIN = 2e-5


@dataclass(frozen=True)
class Stress:
    """Parts of the stress tensor, (3, 3) arrays in kJ/(mol nm^3), of which one is 1.66054 MPa; tension is positive.

    Attributes
    ----------
    chains : of stretching and bending
    linkers : of springs with both hands bound
    crosslinks : of those that are on and join filaments or particles
    contacts : of segments that touch each other or spheres
    ideal : -n k_BT/V on the diagonal, of n nodes and control points that move freely
    """

    chains: FloatArray
    linkers: FloatArray
    crosslinks: FloatArray
    contacts: FloatArray
    ideal: FloatArray

    @property
    def total(self) -> FloatArray:
        """The sum of the parts."""
        return self.chains + self.linkers + self.crosslinks + self.contacts + self.ideal


def stress(run: Run, frame: int, volume: Scalar | None = None) -> Stress:
    """The stress of a frame: ``sigma = (1/V) (sum of r x f over segments, springs and contacts - n k_BT)``.

    r is the vector of a segment, of a spring or between the axes at a contact, and f the force with which it pulls at
    its first end; that of a segment holds stretching and bending, so that ``V sigma`` is the derivative of the energy
    by an affine strain. It is that of the configuration at one time: its average over frames is the stress. Of a
    filament of beam elements, r and f are those of its nodes and control points, which are all among the n that have an
    ideal part.

    What acts from outside is not in it: walls, tethers, anchors, crosslinks to fixed points, friction in a flow. In
    equilibrium within walls, the stress is what the walls hold: its trace is -3 times their mean pressure. Nor are
    other forces of a System, and particles that are not nodes have no ideal part.

    Parameters
    ----------
    run : Run
    frame : int
    volume : volume, optional
        That of the periodic box if not given.

    Returns
    -------
    Stress

    Raises
    ------
    InputError
        Without a periodic box and a volume; with contacts, if the compiled engine is missing.

    Warns
    -----
    PrecisionWarning
        If positions are far from the origin, see ``load``.
    """
    room = volume_of(run, volume)
    run.warn_of_rounding()
    chains, free = np.zeros((3, 3)), np.zeros(3)
    control_points = run.control_points(frame) if any(own.has_beam_elements for own in run.filaments) else []
    for number, (own, nodes) in enumerate(zip(run.filaments, run.nodes(frame))):
        if own.has_beam_elements:
            controls = control_points[number]
            planar = own.is_planar(nodes, controls)
            chains += _virial_of_beam(own.type.beam_element(run.temperature, planar), nodes, controls)
            # Control points are coordinates as well; what keeps its z does not push along it.
            points = len(nodes) - len(own.clamped) + len(controls) - len(own.clamped_tangents)
            free += points * np.array([1.0, 1.0, 0.0 if planar else 1.0])
        else:
            chains += _virial_of_chain(own, nodes)
            free += len(nodes) - len(own.clamped)
    linkers = run.linkers[frame]
    linkers = linkers[(linkers["filaments"] >= 0).all(axis=1)]
    crosslinks = run.crosslinks(frame)
    joining = crosslinks.active & ~crosslinks.at_points
    contacts = run.contacts(frame)
    ideal = -thermal_energy(run.temperature) * np.diag(free)
    return Stress(
        chains=chains / room,
        linkers=_virial_of_springs(linkers["places"], linkers["tension"]) / room,
        crosslinks=_virial_of_springs(crosslinks.places[joining], crosslinks.tensions[joining]) / room,
        contacts=_virial(contacts.directions, -contacts.forces * contacts.distances) / room,
        ideal=ideal / room,
    )


def _virial(vectors, weights):
    return np.einsum("ni,nj,n->ij", vectors, vectors, weights)


def _virial_of_springs(places, tensions):
    vectors = np.asarray(places[:, 1] - places[:, 0], dtype=float)
    lengths = np.linalg.norm(vectors, axis=1)
    return _virial(vectors, np.divide(tensions, lengths, out=np.zeros(len(lengths)), where=lengths > 0.0))


def _virial_of_chain(own, nodes):
    vectors = segment_vectors(nodes, own.ring)
    lengths = np.linalg.norm(vectors, axis=1)
    pulls = (own.type.stretching_derivatives(lengths, own.ring) / lengths)[:, None] * vectors
    stiffnesses = joint_stiffnesses(own.type, len(nodes), own.clamped, own.ring)
    if len(stiffnesses):
        pulls -= own.type.bending_end_forces(vectors, stiffnesses, own.ring)
    return np.einsum("ni,nj->ij", vectors, pulls)


def _virial_of_beam(element, nodes, controls):
    # The derivative of the energy by an affine strain of all its particles: it moves the curve with them.
    strains = np.zeros((3, 3, 4, 3, 3))
    steps = _STRAIN * np.array([1.0, -1.0, 2.0, -2.0])
    for i in range(3):
        for j in range(3):
            # The force along j at a distance along i.
            strains[i, j, :, j, i] = steps
    deformed = np.eye(3) + strains
    points = [np.einsum("...xy,ny->...nx", deformed, own - nodes[0]) for own in (nodes, controls)]
    stretching, bending = element_energies(points[0], points[1], element)
    energies = (stretching + bending).sum(axis=-1)
    return energies @ (np.array([8.0, -8.0, -1.0, 1.0]) / (12.0 * _STRAIN))
