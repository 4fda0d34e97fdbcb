"""The recommended step of filaments of beam elements."""

from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..mechanics.flow import Flow
from ..mechanics.friction import SegmentFriction
from ..units.quantities import thermal_energy
from ..units.types import Scalar
from .time_step import RECOMMENDED_STRAIN, TimeStep, strain_rate

_LINEAR, _CUBIC = 0.0021, 2e-5
_RELAXATION_STEPS = 20.0
# k L of the slowest mode of a free chain, and of that in which a ring becomes oval.
_SLOWEST, _OVAL = 4.73, 10.88
_ADVANCE = 0.1
_REASONS = {
    "bends": "bends of beam elements, which turn as they fluctuate",
    "flow": f"flow, which may strain the solvent by {RECOMMENDED_STRAIN:g} in a step",
    "propulsion": f"propulsion, which may take an element by {_ADVANCE:g} of its length in a step",
    "relaxation": f"relaxation of the whole filament, which takes {_RELAXATION_STEPS:g} steps",
}


def beam_time_step(
    filament_type: ChainType,
    temperature: Scalar,
    scheme: str,
    elements: int,
    flow: Flow | None,
    friction: SegmentFriction,
    propulsion: float = 0.0,
    closed: bool = False,
) -> TimeStep:
    """The step at which averages of a free chain of beam elements are good to 1 %.

    With the length h of an element over the persistence length, eps = h k_B T/EI, and the friction zeta per length
    across it, that is ``dt = (zeta h^4/EI) min(0.0021/eps, 0.00002/eps^3)``: measured for chains of one and of three
    elements with eps from 0.05 to 1, see the page on beam elements. Fewer than one in a thousand steps of a chain are
    divided at it. A step must also resolve the slowest relaxation of the filament, zeta/EI (L/4.73)^4, or that in which
    a ring becomes oval, zeta/EI (L/10.9)^4, by 20 steps, and a flow may strain the solvent by 0.03 in it. Propulsion
    may take an element by a tenth of its length: with that, bends of self-propelled chains of four elements have up to
    2 % too much energy, with a fifth of it 5 to 10 %.

    Parameters
    ----------
    filament_type : FilamentType
        With beam elements.
    scheme : str
        "implicit".
    friction : SegmentFriction
        Of an element.
    propulsion : float
        F0 on each element, in kJ/(mol nm).
    closed : bool
        A ring.

    Raises
    ------
    InputError
        For another scheme.
    """
    if scheme != "implicit":
        raise InputError(f"Beam elements ({filament_type.name!r}) move with scheme 'implicit' alone, not {scheme!r}.")
    element = filament_type.beam_element(temperature)
    h, kT = element.length, thermal_energy(temperature)
    rate = element.rigidity / (friction.perpendicular / h)
    bounds = {"relaxation": (elements * h / (_OVAL if closed else _SLOWEST)) ** 4 / rate}
    allowed = {"relaxation": bounds["relaxation"] / _RELAXATION_STEPS}
    if kT > 0.0:
        bend = h * kT / element.rigidity
        bounds["bends"] = allowed["bends"] = h**4 / rate * min(_LINEAR / bend, _CUBIC / bend**3)
    strain = 0.0 if flow is None else strain_rate(flow)
    if strain > 0.0:
        bounds["flow"] = allowed["flow"] = RECOMMENDED_STRAIN / strain
    if propulsion != 0.0:
        bounds["propulsion"] = h * friction.parallel / abs(propulsion)
        allowed["propulsion"] = _ADVANCE * bounds["propulsion"]
    binding = min(allowed, key=allowed.__getitem__)
    return TimeStep(allowed[binding], _REASONS[binding], bounds, allowed)
