"""The solvent of most tests: the temperature in K, the viscosity, and k_B T in kJ/mol."""

from openmm import unit

from openmm_cylchain.units.quantities import BOLTZMANN

TEMPERATURE = 310.0
KT = BOLTZMANN * TEMPERATURE
VISCOSITY = 1.71e-3 * unit.pascal * unit.second
