"""The stress of a network: the virial of chains, linkers, crosslinks and contacts, and the ideal part of nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..units.quantities import thermal_energy
from ..units.types import FloatArray, Scalar
from .run_filaments import chain_of
from .runs import Run, volume_of


@dataclass(frozen=True)
class Stress:
    """Parts of the stress tensor, (3, 3) arrays in kJ/(mol nm^3), of which one is 1.66054 MPa; tension is positive.

    Attributes
    ----------
    chains : of stretching and bending
    linkers : of springs with both hands bound
    crosslinks : of those that are on and join filaments or particles
    contacts : of segments that touch each other or spheres
    ideal : -n k_BT/V on the diagonal, of n nodes (of beam elements, and control points) that move along that axis
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
    by an affine strain; of beam elements, by one of their nodes and control points. It is that of the configuration at
    one time: its average over frames is the stress.

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
    positions = run.positions(frame)
    grown = run.grown(frame) if any(own.monomer_length for own in run.filaments) else {}
    for number, (own, there) in enumerate(zip(run.filaments, run.nodes(frame))):
        nodes = len(there)
        if not nodes:
            continue
        if number in grown:
            chains += grown[number].virial
        elif own.bent_at_rest:
            raise InputError(f"Filament {number} has bends at rest, whose stress is not known.")
        else:
            parts = positions[own.nodes], positions[own.control_points]
            chains += own.type.segment_kind.virial(chain_of(own, run.temperature), *parts)
        moving = nodes + len(own.control_points) - len(own.clamped) - len(own.clamped_tangents)
        free += moving * np.array([1.0, 1.0, 0.0 if own.planar else 1.0])
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
