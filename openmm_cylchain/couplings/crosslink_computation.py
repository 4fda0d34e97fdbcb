"""Energy and forces of crosslinks: what the PythonForce of a System computes."""

import numpy as np
import openmm

from ..errors import InputError, note_raised_in_force
from ..mechanics.potentials import STRETCHING_POTENTIALS
from ..units.types import FloatArray, FloatOrArray
from .beam_curves import BeamCurves
from .crosslink_tables import RECENT_TABLES, TABLES, CrosslinkTable
from .link_store import unknown_crosslinks


class CrosslinkComputation:
    """The computation of the PythonForce: energy and forces of the crosslinks that a Context has.

    It can be pickled, so a System that holds it can be serialised to XML.

    Parameters
    ----------
    parameter : str
        Name of the context parameter that holds the identity of the table.
    model : {"harmonic", "fene"}
    initial : CrosslinkTable
        What a new Context begins with.
    defaults : tuple
        Stiffness, rest length and maximum extension of crosslinks that are given none.
    """

    def __init__(
        self, parameter: str, model: str, initial: CrosslinkTable, periodic: bool, defaults: tuple[float, float, float]
    ) -> None:
        self.parameter = parameter
        self.model = model
        self.initial = initial
        self.periodic = periodic
        self.defaults = defaults

    def table(self, identity: float) -> CrosslinkTable:
        """The table of an identity; raises InputError if it is not known in this process."""
        if identity == self.initial.identity:
            return self.initial
        table = TABLES.find(int(identity))
        if table is None:
            raise unknown_crosslinks(RECENT_TABLES)
        return table

    def __call__(self, state: openmm.State) -> tuple[float, FloatArray]:
        table = self.table(state.getParameters()[self.parameter])
        positions = state.getPositions(asNumpy=True)._value
        if not len(table):
            return 0.0, np.zeros_like(positions)
        box = state.getPeriodicBoxVectors(asNumpy=True)._value if self.periodic else None
        lengths, vectors = lengths_and_vectors(self.model, table, positions, box)
        # Where places coincide the force has no direction and is zero, as OpenMM has it.
        slopes = slopes_of(self.model, table, lengths)
        pulls = np.divide(slopes, lengths, out=np.zeros_like(lengths), where=lengths > 0)[:, None] * vectors
        particles, links, shares = table.places.holders
        pulls = shares[:, None] * pulls[links]
        forces = np.empty_like(positions)
        for axis in range(3):
            forces[:, axis] = np.bincount(particles, weights=pulls[:, axis], minlength=len(positions))
        return _energy(self.model, table, lengths), forces


def lengths_and_vectors(
    model: str,
    table: CrosslinkTable,
    positions: FloatArray,
    box: FloatArray | None,
    segment_box: FloatArray | None = None,
    curves: BeamCurves | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Lengths (n,) of crosslinks and vectors (n, 3) from their first to their second places, in nm.

    Parameters
    ----------
    model : {"harmonic", "fene"}
    positions : (particles, 3) array
    box, segment_box : (3, 3) array, optional
    curves : BeamCurves, optional
        As for ``CrosslinkTable.displacements``.

    Raises
    ------
    InputError
        If a crosslink that is on has a length that its potential does not allow.
    """
    vectors = table.displacements(positions, box, segment_box, curves)
    lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    if model == "fene":
        _check_extensions(table, lengths)
    return lengths, vectors


def slopes_of(model: str, table: CrosslinkTable, lengths: FloatArray) -> FloatArray:
    """Derivatives dV/dd (n,) in kJ/(mol nm); zero for crosslinks that are off."""
    return _where_active(table, lengths, STRETCHING_POTENTIALS[model].derivative)


def thermal_stiffness_of(
    model: str, stiffness: FloatOrArray, maximum_extension: FloatOrArray, kT: float
) -> FloatOrArray:
    """Stiffness of crosslinks in kJ/(mol nm^2), as ``Crosslinks.thermal_stiffness`` says."""
    if model != "fene":
        return stiffness
    square = np.minimum(4.0 * kT / (3.0 * kT + stiffness * maximum_extension**2), 0.9)
    return stiffness * (1.0 + square) / (1.0 - square) ** 2


def _energy(model, table, lengths):
    return float(np.sum(_where_active(table, lengths, STRETCHING_POTENTIALS[model].energy)))


def _where_active(table, lengths, function):
    columns = (table.stiffness, table.rest_length, table.maximum_extension, lengths)
    if np.all(table.active):
        return function(*columns)
    values = np.zeros_like(lengths)
    values[table.active] = function(*(column[table.active] for column in columns))
    return values


def _check_extensions(table, lengths):
    # Written so that NaN counts as too long.
    broken = ~(np.abs(lengths - table.rest_length) < table.maximum_extension) & table.active
    if broken.any():
        row = int(np.argmax(broken))
        error = InputError(
            f"Crosslink {table.numbers[row]} {table.places.describe(row)} has blown up: its length of "
            f"{lengths[row]:.6g} nm is outside {table.rest_length[row]:g} -/+ {table.maximum_extension[row]:g} nm of "
            "the FENE potential. Use a smaller time step, or look for places that are too far apart."
        )
        note_raised_in_force(error)
        raise error
