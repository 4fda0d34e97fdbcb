"""Energy and forces of crosslinks: what the PythonForce of a System computes."""

import numpy as np
import openmm

from ..errors import InputError, note_raised_in_force
from ..mechanics.potentials import STRETCHING_POTENTIALS
from ..units.types import FloatArray
from .crosslink_tables import RECENT_TABLES, TABLES, CrosslinkTable


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
    periodic : bool
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
            raise InputError(
                "The crosslinks of this Context are not known: its State or checkpoint was saved in another process, "
                f"or more than {RECENT_TABLES} changes ago. Give the crosslinks that belong to it with "
                "Crosslinks.set_table (those that Crosslinks.table returned when it was saved) or Crosslinks.set_pairs."
            )
        return table

    def geometry(
        self, table: CrosslinkTable, state: openmm.State, positions: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Lengths (n,) of crosslinks and vectors (n, 3) from their first to their second particles, in nm."""
        box = state.getPeriodicBoxVectors(asNumpy=True)._value if self.periodic else None
        vectors = table.displacements(positions, box)
        lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        if self.model == "fene":
            _check_extensions(table, lengths)
        return lengths, vectors

    def slopes(self, table: CrosslinkTable, lengths: FloatArray) -> FloatArray:
        """Derivatives dV/dd (n,) in kJ/(mol nm)."""
        derivative = STRETCHING_POTENTIALS[self.model].derivative
        return derivative(table.stiffness, table.rest_length, table.maximum_extension, lengths)

    def energy(self, table: CrosslinkTable, lengths: FloatArray) -> float:
        """Energy of all crosslinks in kJ/mol."""
        energy = STRETCHING_POTENTIALS[self.model].energy
        return float(np.sum(energy(table.stiffness, table.rest_length, table.maximum_extension, lengths)))

    def __call__(self, state: openmm.State) -> tuple[float, FloatArray]:
        table = self.table(state.getParameters()[self.parameter])
        positions = state.getPositions(asNumpy=True)._value
        if not len(table):
            return 0.0, np.zeros_like(positions)
        lengths, vectors = self.geometry(table, state, positions)
        # Where particles coincide the force has no direction and is zero, as OpenMM has it.
        slopes = np.divide(self.slopes(table, lengths), lengths, out=np.zeros_like(lengths), where=lengths > 0)
        pulls = slopes[:, None] * vectors
        pulls = np.concatenate([pulls, -pulls])
        forces = np.empty_like(positions)
        for axis in range(3):
            forces[:, axis] = np.bincount(table.particles, weights=pulls[:, axis], minlength=len(positions))
        return self.energy(table, lengths), forces


def _check_extensions(table, lengths):
    # Written so that NaN counts as too long.
    broken = ~(np.abs(lengths - table.rest_length) < table.maximum_extension)
    if broken.any():
        row = int(np.argmax(broken))
        first, second = table.pairs[row]
        error = InputError(
            f"Crosslink {table.numbers[row]} between particles {first} and {second} has blown up: its length of "
            f"{lengths[row]:.6g} nm is outside {table.rest_length[row]:g} -/+ {table.maximum_extension[row]:g} nm of "
            "the FENE potential. Use a smaller time step, or look for particles that are too far apart."
        )
        note_raised_in_force(error)
        raise error
