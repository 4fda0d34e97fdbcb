"""The stress of a network: the virial of chains and of linkers, and the ideal part of nodes."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..filaments.placement import joint_stiffnesses
from ..mechanics.geometry import segment_vectors
from ..units.quantities import VOLUME, positive, thermal_energy
from ..units.types import FloatArray, Scalar
from .runs import Run


@dataclass(frozen=True)
class Stress:
    """Parts of the stress tensor, (3, 3) arrays in kJ/(mol nm^3), of which one is 1.66054 MPa; tension is positive.

    Attributes
    ----------
    chains : of stretching and bending
    linkers : of springs with both hands bound
    ideal : -n k_BT/V on the diagonal, of n nodes that move freely
    """

    chains: FloatArray
    linkers: FloatArray
    ideal: FloatArray

    @property
    def total(self) -> FloatArray:
        """The sum of the parts."""
        return self.chains + self.linkers + self.ideal


def stress(run: Run, frame: int, volume: Scalar | None = None) -> Stress:
    """The stress of a frame: ``sigma = (1/V) (sum of r x f over segments and springs - n k_BT)``.

    r is the vector of a segment or a spring and f the force with which it pulls at its first end; that of a segment
    holds stretching and bending, so that ``V sigma`` is the derivative of the energy by an affine strain. It is that of
    the configuration at one time: its average over frames is the stress. Contacts, walls, tethers, anchors of linkers
    and friction in a flow are not in it.

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
        Without a periodic box and a volume.

    Warns
    -----
    PrecisionWarning
        If positions are far from the origin, see ``load``.
    """
    if volume is not None:
        room = positive(volume, VOLUME, "volume")
    elif run.box is not None:
        room = float(np.linalg.det(run.box))
    else:
        raise InputError("There is no periodic box: give the volume of which the stress is wanted.")
    run.warn_of_rounding()
    chains, free = np.zeros((3, 3)), 0
    for own, nodes in zip(run.filaments, run.nodes(frame)):
        chains += _virial_of_chain(own, nodes)
        free += len(nodes) - len(own.clamped)
    records = run.linkers[frame]
    records = records[(records["filaments"] >= 0).all(axis=1)]
    springs = np.asarray(records["places"][:, 1] - records["places"][:, 0], dtype=float)
    lengths = np.linalg.norm(springs, axis=1)
    pulls = np.divide(records["tension"], lengths, out=np.zeros(len(lengths)), where=lengths > 0.0)
    linkers = np.einsum("ni,nj,n->ij", springs, springs, pulls)
    ideal = -free * thermal_energy(run.temperature) * np.eye(3)
    return Stress(chains / room, linkers / room, ideal / room)


def _virial_of_chain(own, nodes):
    vectors = segment_vectors(nodes, own.ring)
    lengths = np.linalg.norm(vectors, axis=1)
    pulls = (own.type.stretching_derivatives(lengths, own.ring) / lengths)[:, None] * vectors
    stiffnesses = joint_stiffnesses(own.type, len(nodes), own.clamped, own.ring)
    if len(stiffnesses):
        pulls -= own.type.bending_end_forces(vectors, stiffnesses, own.ring)
    return np.einsum("ni,nj->ij", vectors, pulls)
