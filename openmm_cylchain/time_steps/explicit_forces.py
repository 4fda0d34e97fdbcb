"""Stiffness of the forces of a System that are taken at the start of a step, and the step that they allow.

Such a force is a set of springs: from a particle to a fixed point (walls, restraints), or between two particles (bonds,
crosslinks, contacts), which are nodes, places on filaments, or particles with a friction of their own. The largest
eigenvalue lambda of response and stiffness (see ``mobility``) says how much too large a variance is, by the factor
1/(1 - lambda/2) at most, and from lambda = 2 on the System is thrown apart.
"""

import math
import warnings
from collections.abc import Sequence

import numpy as np
import openmm
import scipy

from ..errors import TimeStepWarning
from ..filaments.collection import FilamentCollection
from ..units.text import format_time
from ..units.types import Numbers
from .coupled_forces import CoupledForces
from .schemes import EXPLICIT_SCHEMES, IMPLICIT_SCHEMES
from .spring_places import SpringPlaces
from .spring_reader import SpringReader
from .springs import ACCURATE, NOWHERE, Springs
from .time_step import TimeStep

UNSTABLE = 2.0
"""lambda from which on the System is thrown apart."""

TOO_STIFF = 2.0 * (1.0 - 1.0 / 1.10)
"""lambda from which on a System is warned of: variances may be 10 % too large."""

_TOGETHER = "explicit forces together"


class ExplicitForces:
    """The forces of a System with filaments that are taken at the start of a step.

    Parameters
    ----------
    filaments : Filaments
        In the System.
    scheme : {"implicit", "implicit-second-order", "midpoint", "euler"}
        Tethers are among these forces where it is explicit.
    particle_friction : energy*time/length^2, or array of them, optional
        As for ``Filaments.create_integrator``.
    coupled_forces : CoupledForces, optional
        Of the System, if it is known.

    Attributes
    ----------
    springs : list of Springs
    unknown : tuple of str
        Forces whose stiffness is not known.
    constant_forces : dict of int to (3,) arrays
        What external forces that do not change with positions add up to on each particle, in kJ/(mol nm).
    """

    def __init__(
        self,
        system: openmm.System,
        filaments: FilamentCollection,
        scheme: str,
        particle_friction: Numbers | None = None,
        coupled_forces: CoupledForces | None = None,
    ) -> None:
        self.springs: list[Springs] = []
        unknown: list[str] = []
        coupled = coupled_forces or CoupledForces(system)
        reader = SpringReader(system, filaments)
        for index, force in enumerate(system.getForces()):
            name = label = f"{force.getName()} (force {index})"
            if scheme in IMPLICIT_SCHEMES and coupled.may_include(index):
                outside = coupled.place_outside(index)
                if outside is None:
                    continue
                label = f"{name}, explicit because of {outside}"
            found = reader.read(force, label)
            if found is None:
                unknown.append(name)
            else:
                self.springs += [one for one in found if np.any(one.stiffness > 0.0)]
        if scheme in EXPLICIT_SCHEMES and filaments.tethers:
            nodes = [filaments.node_indices[tether.filament][tether.node] for tether in filaments.tethers]
            stiffness = [tether.stiffness for tether in filaments.tethers]
            self.springs.append(Springs.at_points("Tethers", "tether", nodes, stiffness))
        self.constant_forces = reader.constant_forces
        self._places = SpringPlaces(system, filaments, scheme, particle_friction, self.springs, reader.between)
        self.unknown = (*unknown, *self._places.unknown)

    def recommended_step(self) -> TimeStep:
        """The TimeStep of these forces, one by one and together; an infinite step if there are none."""
        bounds, allowed = {}, {}
        accurate = [one for one in self.springs if one.accurate == ACCURATE]
        for one in self.springs:
            step = self.allowed_step([one], one.accurate)
            name = self.eigenvalue([one], min(step, 1e30))[1]
            bounds[name], allowed[name] = self.allowed_step([one], UNSTABLE), step
        if len(accurate) > 1:
            bounds[_TOGETHER] = self.allowed_step(accurate, UNSTABLE)
            allowed[_TOGETHER] = self.allowed_step(accurate, ACCURATE)
        if not allowed:
            return TimeStep(math.inf, "no forces beside filaments", {}, {}, self.unknown)
        binding = min(allowed, key=allowed.__getitem__)
        named = f"{self.eigenvalue(accurate, allowed[binding])[1]} most of all, " if binding == _TOGETHER else ""
        reason = f"{binding}: {named}explicit, so its fluctuations may be 5 % too large"
        return TimeStep(allowed[binding], reason, bounds, allowed, self.unknown)

    def warn_if_too_stiff(self, step: float) -> None:
        """Issue a TimeStepWarning, naming the spring, if variances may be 10 % too large in a step in ps."""
        accurate = [one for one in self.springs if one.accurate == ACCURATE]
        if not accurate:
            return
        largest, name = self.eigenvalue(accurate, step)
        if largest > TOO_STIFF:
            excess = 1.0 / (1.0 - 0.5 * largest) - 1.0 if largest < UNSTABLE else math.inf
            what = f"fluctuations may be {100.0 * excess:.3g} % too large" if excess < 10.0 else "it is thrown apart"
            warnings.warn(
                f"A time step of {format_time(step, 4)} is too long for forces that are explicit, most of all {name}: "
                f"{what}. Recommended for these forces: {format_time(self.allowed_step(accurate, ACCURATE), 4)}.",
                TimeStepWarning,
                stacklevel=4,
            )

    def allowed_step(self, springs: Sequence[Springs], target: float) -> float:
        """The longest step, in ps, in which lambda of some springs does not exceed ``target``."""
        # The response grows no faster than the step.
        start = 1e-9
        shortest = target * start / max(self.eigenvalue(springs, start)[0], 1e-300)
        if shortest > 1e250:
            return math.inf

        def excess(step):
            return self.eigenvalue(springs, step)[0] - target

        below, above = shortest * (1.0 - 1e-6), shortest * (1.0 + 1e-3)
        while excess(above) < 0.0:
            below, above = above, 8.0 * above
            if above > 1e12 * shortest:
                return math.inf
        bracket = math.log(below), math.log(above)
        return math.exp(scipy.optimize.brentq(lambda x: excess(math.exp(x)), *bracket, xtol=1e-3))

    def eigenvalue(self, springs: Sequence[Springs], step: float) -> tuple[float, str]:
        """lambda of some springs in a step in ps, and the name of the spring that has most part in it.

        A spring between two particles with the responses r and s is taken as springs k (r + s)/r and k (r + s)/s to
        fixed points, which is exact for one and an upper bound for several.
        """
        responses = self._places.responses(step)
        demand = np.zeros(len(responses))
        for one in springs:
            for sites, stiffness in self._shares(one, responses):
                demand += np.bincount(sites, weights=stiffness, minlength=len(demand))
        largest, sites_there = self._places.largest_eigenvalue(demand, step)
        return largest, self._name_of_worst(springs, responses, sites_there)

    def _name_of_worst(self, springs, responses, sites_there):
        name, most = "", -1.0
        for one in springs:
            for sites, stiffness in self._shares(one, responses):
                part = np.where(sites_there[sites], stiffness * responses[sites], -1.0)
                if len(part) and part.max() > most:
                    row = int(np.argmax(part))
                    most = float(part[row])
                    kept = np.flatnonzero(self._kept(one))
                    name = f"{one.force}: {one.item} {one.numbers[kept[row]]}"
        return name

    def _kept(self, springs):
        return (self._places.site_of[springs.first] >= 0) & (self._places.site_of[springs.second] >= NOWHERE)

    def _shares(self, springs, responses):
        # Sites and the stiffness of the spring to a fixed point that each of them is given.
        kept = self._kept(springs)
        first, second = self._places.site_of[springs.first[kept]], springs.second[kept]
        stiffness = springs.stiffness[kept]
        paired = second != NOWHERE
        mine, other = responses[first], np.zeros(len(first))
        other[paired] = responses[self._places.site_of[second[paired]]]
        total = mine + other
        with np.errstate(divide="ignore", invalid="ignore"):
            yield first, np.where(mine > 0.0, stiffness * total / mine, 0.0)
            share = np.where(other > 0.0, stiffness * total / other, 0.0)
        # In the order of the first ones, so that a row is a spring in both.
        sites = np.where(paired, self._places.site_of[second], first)
        yield sites, np.where(paired, share, 0.0)
