"""Small transverse fluctuations of straight chains: exact relaxation of the discrete chain, linear in the deflections.

With the deflections y of the nodes, Z dy/dt = -K y + noise. A segment has the friction gamma_perp for the mean
deflection of its two ends and gamma_rot for the angle (y' - y)/l0; a joint has the stiffness a/l0 for its angle.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh


@dataclass(frozen=True)
class TransverseModes:
    """Modes of a chain, the slowest first.

    Attributes
    ----------
    rates : (modes,) array
        In 1/ps; translation and rotation of a free chain are left out.
    shapes : (nodes, modes) array
        Deflections y = shapes q, where each q has the variance k_B T/rate.
    projections : (modes, nodes) array
        q = projections y.
    """

    rates: np.ndarray
    shapes: np.ndarray
    projections: np.ndarray

    def autocorrelation(self, weights, time):
        """<x(0) x(t)>/<x^2> of x = weights.y at given times in ps."""
        shares = (weights @ self.shapes) ** 2 / self.rates
        return np.exp(-np.multiply.outer(time, self.rates)) @ shares / shares.sum()


def transverse_modes(rigidity, friction, segment_length, segments, clamped=False):
    """Transverse modes of a chain.

    Parameters
    ----------
    rigidity : float
        a in kJ nm/mol.
    friction : SegmentFriction
    segment_length : float
        In nm.
    segments : int
        Free ones.
    clamped : bool
        Clamped at one end, by a held segment before the first: the joint there is twice as stiff. The nodes of the
        modes are those behind the clamp.

    Returns
    -------
    TransverseModes
    """
    held = 1 if clamped else 0
    resistance, stiffness = transverse_matrices(rigidity, friction, segment_length, segments + held, clamped)
    free = slice(2 * held, None)
    resistance = resistance[free, free]
    rates, shapes = eigh(stiffness[free, free], resistance)
    bending = slice(0 if clamped else 2, None)
    rates, shapes = rates[bending], shapes[:, bending]
    return TransverseModes(rates, shapes, shapes.T @ resistance)


def transverse_matrices(rigidity, friction, segment_length, segments, clamped=False):
    """Z and K of all nodes, (nodes, nodes) each; see ``transverse_modes``, but ``segments`` counts a held one, too."""
    ends = np.eye(segments + 1)
    middles, angles = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends, axis=0) / segment_length
    resistance = friction.perpendicular * middles.T @ middles + friction.rotational * angles.T @ angles
    joints = np.diff(angles, axis=0)
    stiffness = np.full(len(joints), rigidity / segment_length)
    if clamped:
        stiffness[0] *= 2.0
    return resistance, joints.T * stiffness @ joints
