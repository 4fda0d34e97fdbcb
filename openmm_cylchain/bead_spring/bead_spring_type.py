"""BeadSpringType: an extensible, semiflexible chain of beads, and a preset for DNA by base pairs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from openmm import unit

from ..errors import InputError
from ..filaments.chain_type import ChainType, check_bending_is_given_once, check_type_name, number_of
from ..filaments.straight_segments import StraightSegments
from ..mechanics.friction import SegmentFriction
from ..mechanics.potentials import BOND_DIFFERENCE
from ..units.quantities import (
    BENDING_RIGIDITY,
    DIMENSIONLESS,
    FORCE,
    FRICTION,
    LENGTH,
    MASS,
    TEMPERATURE,
    VISCOSITY,
    positive,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.types import FloatArray, Scalar
from .draws import draw_bonds
from .transfer_operator import straight_lengths


class BeadBonds(StraightSegments):
    """Segments between beads, whose lengths and angles do not fluctuate independently."""


BEAD_BONDS = BeadBonds()


@dataclass(frozen=True, kw_only=True)
class BeadSpringType(ChainType):
    """A chain of beads with isotropic friction, joined by springs that resist stretching and bending: a description.

    The model of Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603, after Barkema and van Leeuwen, J. Stat.
    Mech. 2012, P12019: beads r_0 ... r_N with bonds u_n = r_n - r_(n-1) and the energy

        H = (lambda/2) sum_n (|u_n| - d)^2 - kappa sum_n u_n.u_(n+1).                                   (1)

    Beads are overdamped, with the friction xi each and no hydrodynamic interaction. Up to a constant this is

        (k/2) sum_inner (|u_n| - a)^2 + (k_e/2) sum_ends (|u_n| - l_e)^2 + (kappa/2) sum_n |u_(n+1) - u_n|^2

    with the stiffness k = lambda (1 - 2 nu) and the rest length a = d/(1 - 2 nu) of bonds in the middle of a chain,
    k_e = lambda (1 - nu) and l_e = d/(1 - nu) of its two end bonds (lambda and d of a single bond), nu = kappa/lambda.
    A ring has none at an end. So it is the extensible wormlike chain (EI/2) int |t'|^2 + (K/2) int (|r'| - 1)^2, cut
    into beads a distance a apart, with kappa = EI/a^3 and k = K/a, but for its end bonds, which are shorter.

    All arguments are keywords and take ``openmm.unit`` quantities or plain numbers in OpenMM's units; the attributes
    hold plain numbers in OpenMM's units (nm, ps, kJ/mol, Da). ``from_reduced`` takes the paper's parameters instead.

    Parameters
    ----------
    name : str
        Residue name of its beads in topologies and its name in messages; up to 5 letters or digits.
    bead_spacing : length
        a, the length of a bond in the middle of a chain.
    bead_friction : energy*time/length^2
        xi, the friction coefficient of one bead.
    persistence_length : length with temperature : temperature
        l_p = kappa a^3/(k_B T), eq. (3). Bonds decorrelate over ``theory.bead_spring_persistence_length``, which is
        less by the order of a.
    bending_rigidity : energy*length
        Instead of a persistence length: EI = kappa a^3.
    stretching_modulus : force
        K = lambda d, the force that stretches the chain to twice its length.
    diameter : length
        Of the filament, for contacts; it has no part in the dynamics.
    bead_mass : mass
        For OpenMM, which asks for it; the dynamics does not depend on it.

    Raises
    ------
    InputError
        For a value that is missing, given twice, not finite, of the wrong unit, zero or negative.

    Notes
    -----
    lambda, kappa, d and xi belong to the material: they stay when a simulation runs at another temperature, where
    ``reduced_temperature`` and ``persistence_length_at`` differ. The viscosity of the solvent has no part in it.
    """

    name: str
    diameter: float
    bead_spacing: float
    bead_friction: float
    stretching_modulus: float
    bending_rigidity: float = None  # type: ignore[assignment]  # None is for the constructor.
    persistence_length: float | None = field(default=None, repr=False)
    temperature: float | None = field(default=None, repr=False)
    bead_mass: float = 650.0

    if TYPE_CHECKING:  # What may be given; the attributes hold plain numbers.

        def __init__(
            self,
            *,
            name: str,
            diameter: Scalar,
            bead_spacing: Scalar,
            bead_friction: Scalar,
            stretching_modulus: Scalar,
            bending_rigidity: Scalar | None = None,
            persistence_length: Scalar | None = None,
            temperature: Scalar | None = None,
            bead_mass: Scalar = 650.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_type_name(self.name)
        label = f"of filament type {self.name!r}"
        for attribute, dimension in (
            ("diameter", LENGTH),
            ("bead_spacing", LENGTH),
            ("bead_friction", FRICTION),
            ("stretching_modulus", FORCE),
            ("bead_mass", MASS),
        ):
            self._set(attribute, positive(getattr(self, attribute), dimension, f"{attribute} {label}"))
        check_bending_is_given_once(self.name, self.bending_rigidity, self.persistence_length)
        if (self.persistence_length is None) != (self.temperature is None):
            raise InputError(f"Filament type {self.name!r}: persistence_length and its temperature go together.")
        if self.persistence_length is None:
            rigidity = positive(self.bending_rigidity, BENDING_RIGIDITY, f"bending_rigidity {label}")
        else:
            length = positive(self.persistence_length, LENGTH, f"persistence_length {label}")
            assert self.temperature is not None
            rigidity = length * thermal_energy(positive(self.temperature, TEMPERATURE, f"temperature {label}"))
        self._set("bending_rigidity", rigidity)
        self._set("persistence_length", None)
        self._set("temperature", None)

    def _set(self, attribute, value):
        object.__setattr__(self, attribute, value)

    @classmethod
    def from_reduced(
        cls,
        *,
        name: str,
        diameter: Scalar,
        nu: float,
        reduced_temperature: float,
        bead_spacing: Scalar,
        temperature: Scalar,
        bead_friction: Scalar,
        bead_mass: Scalar = 650.0,
    ) -> BeadSpringType:
        """The type with the parameters nu = kappa/lambda and T* = k_B T/(lambda d^2) of eq. (2) at a temperature.

        With a = d/(1 - 2 nu): lambda = k_B T/(T* d^2), K = lambda d and EI = nu lambda a^3.

        Parameters
        ----------
        name, diameter, bead_spacing, bead_friction, bead_mass
            As of the class.
        nu : float
            Above 0 and below 1/2.
        reduced_temperature : float
            T*, above zero.
        temperature : temperature
            At which T* holds.

        Raises
        ------
        InputError
            For values out of these ranges.
        """
        label = f"of filament type {name!r}"
        nu = positive(nu, DIMENSIONLESS, f"nu {label}")
        if nu >= 0.5:
            raise InputError(f"nu {label} must be below 1/2, but is {nu:g}: the chain would not be stable.")
        spacing = positive(bead_spacing, LENGTH, f"bead_spacing {label}")
        energy = thermal_energy(positive(temperature, TEMPERATURE, f"temperature {label}"))
        energy /= positive(reduced_temperature, DIMENSIONLESS, f"reduced_temperature {label}")
        natural = spacing * (1.0 - 2.0 * nu)
        return cls(
            name=name,
            diameter=diameter,
            bead_spacing=spacing,
            bead_friction=bead_friction,
            stretching_modulus=energy / natural,
            bending_rigidity=nu * energy / natural**2 * spacing**3,
            bead_mass=bead_mass,
        )

    def coarse_grained(self, beads: int) -> BeadSpringType:
        """The same filament with one bead where there were ``beads``, eqs. (52) to (55).

        Spacing, friction and mass of a bead grow in proportion; EI and K, and so the extension under a force, stay.
        With r = l_p/a and y = l_p K/(k_B T) this makes T* = (2 r^2 + k^2 y) r/(k^3 y^2) and
        nu = r^2/(2 r^2 + k^2 y). k a must stay well below l_p.
        """
        beads = whole_number(beads, 1, "beads")
        return replace(
            self,
            bead_spacing=beads * self.bead_spacing,
            bead_friction=beads * self.bead_friction,
            bead_mass=beads * self.bead_mass,
        )

    @property
    def stiffness(self) -> float:
        """lambda of eq. (1) in kJ/(mol nm^2): K/a + 2 kappa, eq. (13)."""
        return self.stretching_modulus / self.bead_spacing + 2.0 * self.bending_stiffness

    @property
    def bending_stiffness(self) -> float:
        """kappa of eq. (1) in kJ/(mol nm^2): EI/a^3."""
        return self.bending_rigidity / self.bead_spacing**3

    @property
    def natural_length(self) -> float:
        """d of eq. (1) in nm: K/lambda = a (1 - 2 nu)."""
        return self.stretching_modulus / self.stiffness

    @property
    def nu(self) -> float:
        """kappa/lambda, above 0 and below 1/2."""
        return self.bending_stiffness / self.stiffness

    @property
    def time_unit(self) -> float:
        """xi/lambda in ps, the unit of time of the paper."""
        return self.bead_friction / self.stiffness

    def reduced_temperature(self, temperature: Scalar) -> float:
        """T* = k_B T/(lambda d^2) at a temperature."""
        return thermal_energy(temperature) / (self.stiffness * self.natural_length**2)

    @property
    def segment_kind(self) -> BeadBonds:
        """``BEAD_BONDS``."""
        return BEAD_BONDS

    @property
    def bending_model(self) -> str:
        """The model "bond-difference": (kappa/2) |u_(n+1) - u_n|^2."""
        return BOND_DIFFERENCE

    @property
    def stretching_model(self) -> str:
        """The model "harmonic"."""
        return "harmonic"

    @property
    def maximum_extension(self) -> None:
        """None: a bond may have any length."""

    @property
    def segment_length(self) -> float:
        """``bead_spacing``, the rest length of a bond in nm that is not at an end."""
        return self.bead_spacing

    @property
    def segment_stiffness(self) -> float:
        """Stiffness lambda (1 - 2 nu) = K/a in kJ/(mol nm^2) of a bond that is not at an end."""
        return self.stretching_modulus / self.bead_spacing

    @property
    def joint_stiffness(self) -> float:
        """K = kappa a^2 = EI/a in kJ/mol: K theta^2/2 is the energy of a small angle between bonds of length a."""
        return self.bending_rigidity / self.bead_spacing

    @property
    def clamped_bending_stiffness(self) -> float:
        """``bending_stiffness``: a bond that is held does not differ from others."""
        return self.bending_stiffness

    @property
    def node_friction(self) -> float:
        """``bead_friction``."""
        return self.bead_friction

    def segment_lengths(self, segments: int, closed: bool = False) -> FloatArray:
        """Rest lengths (segments,) in nm: a, or d/(1 - nu) of the end bonds of an open chain, d of a single bond."""
        lengths = np.full(number_of(segments, "segments"), self.bead_spacing)
        if not true_or_false(closed, "closed"):
            lengths[[0, -1]] = self.stretching_modulus / self.segment_stiffnesses(segments)[0]
        return lengths

    def segment_stiffnesses(self, segments: int, closed: bool = False) -> FloatArray:
        """Stiffnesses (segments,) in kJ/(mol nm^2): lambda (1 - 2 nu), lambda (1 - nu) of the end bonds of an open
        chain, lambda of a single bond."""
        stiffnesses = np.full(number_of(segments, "segments"), self.segment_stiffness)
        if not true_or_false(closed, "closed"):
            # An end bond has one neighbour, a single bond none.
            stiffnesses[[0, -1]] = self.stiffness - (self.bending_stiffness if segments > 1 else 0.0)
        return stiffnesses

    def straight_lengths(self, segments: int) -> FloatArray:
        """Lengths (segments,) in nm of the bonds of a straight open chain on which no forces act.

        ``v_n - nu (v_(n-1) + v_(n+1)) = d`` with v_0 = v_(N+1) = 0: they grow from the ends to a.
        """
        return self.natural_length * straight_lengths(self.nu, number_of(segments, "segments"))

    def node_masses(self, nodes: int, closed: bool = False) -> FloatArray:
        """Masses (nodes,) in Da: ``bead_mass``."""
        true_or_false(closed, "closed")
        return np.full(number_of(nodes, "nodes", 2), self.bead_mass)

    def segment_friction(self, viscosity: Scalar, temperature: Scalar, segments: int = 1) -> SegmentFriction:
        """Friction of the cylinder of the length a that resists as beads do, half of xi at either end.

        gamma_par = gamma_perp = xi, gamma_rot = gamma_def = xi a^2/4. Estimates use it, simulations do not.
        """
        positive(viscosity, VISCOSITY, "viscosity")
        thermal_energy(temperature)
        number_of(segments, "segments")
        turning = 0.25 * self.bead_friction * self.bead_spacing**2
        return SegmentFriction(self.bead_friction, self.bead_friction, turning, turning)

    def _stretching_energies(self, lengths, closed):
        """As in the second form of the energy, not in eq. (1)."""
        segments = np.shape(lengths)[-1]
        extension = lengths - self.segment_lengths(segments, closed)
        return 0.5 * self.segment_stiffnesses(segments, closed) * extension**2

    def _stretching_derivatives(self, lengths, closed):
        segments = np.shape(lengths)[-1]
        return self.segment_stiffnesses(segments, closed) * (lengths - self.segment_lengths(segments, closed))

    def _check_folds(self, vectors, label, closed):
        """Nothing: the forces of ``bending_energies`` are defined between any two bonds."""

    def _bending_energies(self, vectors, stiffnesses, closed):
        """(kappa/2) |u_(n+1) - u_n|^2."""
        kappa = self.bending_stiffness if stiffnesses is None else stiffnesses
        return 0.5 * kappa * np.sum(_bond_differences(vectors, closed) ** 2, axis=-1)

    def _bending_end_forces(self, vectors, stiffnesses, closed):
        pairs = stiffnesses[:, None] * _bond_differences(vectors, closed)
        if closed:
            return np.roll(pairs, -1, axis=0) - pairs
        none = np.zeros((1, 3))
        return np.concatenate([pairs, none]) - np.concatenate([none, pairs])

    def _draw_chain(self, segments, temperature, generator, start, direction, planar, joint_stiffnesses):
        reduced = self.reduced_temperature(positive(temperature, TEMPERATURE, "temperature"))
        (bonds,) = draw_bonds(self.nu, reduced, segments, generator, 1, planar, direction)
        steps = self.natural_length * np.cumsum(bonds, axis=0)
        return np.asarray(start, dtype=float) + np.concatenate([np.zeros((1, 3)), steps])


def _bond_differences(vectors, closed):
    if closed:
        return vectors - np.roll(vectors, 1, axis=-2)
    return np.diff(vectors, axis=-2)


_ROOM_TEMPERATURE = 296.15 * unit.kelvin
_DIFFUSION_OF_20_BASE_PAIRS = 1.07e8 * unit.nanometer**2 / unit.second

DSDNA_BASE_PAIRS = BeadSpringType.from_reduced(
    name="DBP",
    diameter=2 * unit.nanometer,
    nu=0.35,
    reduced_temperature=0.034,
    bead_spacing=0.33 * unit.nanometer,
    temperature=_ROOM_TEMPERATURE,
    bead_friction=unit.MOLAR_GAS_CONSTANT_R * _ROOM_TEMPERATURE / (20.0 * _DIFFUSION_OF_20_BASE_PAIRS),
    bead_mass=650 * unit.dalton,
)
"""Double-stranded DNA with one bead for every base pair, as Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603.

a = 0.33 nm, nu = 0.35 and T* = 0.034, which Barkema and van Leeuwen, J. Stat. Mech. 2012, P12019, fitted to the force
extension curve of Wang et al., Biophys. J. 1997, 72, 1335: l_p = 114.4 a = 37.7 nm and K = 1215 pN at 23 C. The
friction is that of beads that diffuse as 20 base pairs do at 23 C, eq. (69): xi = k_B T/(20 D) = 1.91e-12 kg/s with
D = 1.07e8 nm^2/s (capillary electrophoresis, light scattering and NMR; the paper has the sources).

What the paper prints does not fit together everywhere. a^2 xi/k_B T is 50.9 ps with these numbers, where (71) has 52.0,
so one unit of time xi/lambda is 0.156 ps here, 0.159 ps in the tables of the paper; the 1.5 ps of its Sections III A
and VIII and of Table V are ten times too long. Table III holds for another preset than this one, with r = 120 and
y = 12000, in place of r = 114.4 and y = 11214; ``coarse_grained`` follows (55) from these.
"""
