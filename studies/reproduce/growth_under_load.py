"""Filaments that grow against loads: forces at which they stall and speeds, beside the theory of Brownian ratchets."""

from dataclasses import asdict, replace

import numpy as np

from benchmark.measurement import Estimate
from openmm_cylchain import ACTIN_ATP, TUBULIN
from openmm_cylchain.units.quantities import PICONEWTON

from . import simulation, style
from .case import Case, Outcome
from .ratchets import KT, STALL, TEMPERATURE, Ratchet, exact_speed, speed_of_fast_obstacle
from .result import Result, Rule

TITLE = "Filaments that grow against loads"
CITATION = (
    "C. S. Peskin, G. M. Odell and G. F. Oster, *Cellular motions and thermal fluctuations: the Brownian ratchet*, "
    "Biophys. J. 1993, 65, 316"
)

_MONOMERS = {"actin": ACTIN_ATP.length, "tubulin": TUBULIN.length}
_STALLS = {
    "actin_at_a_plane": Ratchet(STALL),
    "actin_at_a_filament_across": Ratchet(STALL, obstacle="rod"),
    "tubulin_at_a_plane": Ratchet(STALL, monomer=TUBULIN.length),
    "tubulin_at_a_filament_across": Ratchet(STALL, obstacle="rod", monomer=TUBULIN.length),
    "actin_at_a_fast_plane": Ratchet(STALL, diffusion=10.0),
    "actin_in_five_times_longer_steps": Ratchet(STALL, step=1.0),
}
_BESIDE_STALL = 0.05
"""By what share of the load of theory the two loads differ from it, between which an end stalls."""
_STIFFNESSES = {0.1: 40.0, 1.0: 4.0, 10.0: 4.0}
"""Of contacts, by D: slow obstacles would go far into soft ones."""
_SHARES = (0.1, 0.25, 0.45, 0.7)
"""Loads in those at which an end stalls."""
_STEPS = (0.05, 0.2, 0.5, 1.0, 2.0)
_COPIES = {False: 100, True: 40}
_DURATIONS = {False: 5000, True: 2500}
"""In recommended steps; of other steps, the more as these are short, as the square root."""
_ON_RATCHETS = """Do this first, [from a clone](../commands.md): `python studies reproduce ratchets --output DIR`, some
five to ten minutes (`--quick`: two or three).

**What is simulated.** Rods, as stiff as bundles, grow along a line at their plus end. Two nodes at the minus end are
fixed. A constant force presses an obstacle on the tip: a plane (a sphere 6 µm wide), or another filament that lies
across. Monomers come ten times as fast as they go, k_on c = 10 k_off, at {temperature:g} K. Speeds over δ k_on c
depend on w = fδ/k_BT, on D/(δ² k_on c) with the diffusion constant D of the obstacle, and on k_on c h alone. Where
nothing else is said, D/(δ² k_on c) is 1, and steps are those that are recommended, k_on c h = 0.2.

**What to expect.** An end stalls at f = (k_BT/δ) ln(k_on c/k_off): at {actin:.2f} pN with actin's δ = 2.7 nm and at
{tubulin:.2f} pN with the 8/13 nm of tubulin, whatever it pushes. If the obstacle diffuses fast, it grows with
δ(k_on c exp(-w) - k_off), else more slowly. The theory in the table is the master equation of the gap in the limit of
short steps; in its limits it is the formula above, and that of Peskin, Odell and Oster.

**Steps.** An end that gains several monomers in a step does so before the obstacle moves on: it is too slow. The
force at which it stalls stays right. Speeds at w = 1 over those of short steps:

| k_on c h | speed |
|---|---|
{steps}

**Contacts.** All this holds in steps that resolve contacts
([how long](../networks.md#how-long-a-step-resolves-contacts)), also that of the obstacle: 2kDh/k_BT below 18. Contacts
here have k = 4 k_BT/δ², and ten times that at the slowest obstacle. Longer steps have hard contacts, for which neither
stall forces nor speeds are right."""


def _force(load, monomer):
    return load * KT / monomer / PICONEWTON


def _speed(records, name, ratchet, quick, seed=1):
    def speeds_of_ratchet(copies, steps, seed, **ratchet):
        return {"speeds": Ratchet(**ratchet).speeds(copies, steps, seed)}

    steps = round(_DURATIONS[quick] * (Ratchet.step / ratchet.step) ** 0.5)
    settings = {"copies": _COPIES[quick], "steps": steps, "seed": seed, **asdict(ratchet)}
    return simulation.mean(records.measure(name, speeds_of_ratchet, **settings)["speeds"])


def _stall(records, name, ratchet, quick):
    """The force in pN at which the end stands still, on the line between two loads."""
    loads = STALL * np.array([1.0 - _BESIDE_STALL, 1.0 + _BESIDE_STALL])
    speeds = [
        _speed(records, f"stall-{name}-{number}", replace(ratchet, load=float(load)), quick, number)
        for number, load in enumerate(loads, 1)
    ]
    slope = (speeds[0].value - speeds[1].value) / (loads[1] - loads[0])
    load = loads.mean() + 0.5 * (speeds[0].value + speeds[1].value) / slope
    error = 0.5 * np.hypot(speeds[0].error, speeds[1].error) / slope
    return Estimate(float(_force(load, ratchet.monomer)), float(_force(error, ratchet.monomer)))


def _draw(figure, speeds):
    axis = figure.subplots()
    shares = np.linspace(0.05, 1.1, 43)
    for (diffusion, stiffness), colour in zip(_STIFFNESSES.items(), style.COLOURS):
        exact = [exact_speed(Ratchet(STALL * share, diffusion, stiffness=stiffness), 50) for share in shares]
        axis.plot(shares, exact, color=colour, lw=1.0, label=f"theory, D = {diffusion:g} δ² $k_{{on}}$c")
        own = [speeds[diffusion, share] for share in _SHARES]
        axis.errorbar(
            _SHARES, [one.value for one in own], [one.error for one in own], ls="", marker="o", ms=4, color=colour
        )
    axis.plot(shares, speed_of_fast_obstacle(STALL * shares), color=style.THEORY, ls="--", lw=1.0, label="D → ∞")
    axis.axhline(0.0, color="grey", lw=0.5)
    style.finish(axis, "load f over $(k_BT/δ)$ ln($k_{on}$c/$k_{off}$)", "speed over δ $k_{on}$c")


def evaluate(records, quick):
    """Stall forces, speeds against loads, and speeds in longer steps."""
    results = [
        Result(
            f"stall_force_of_{name}",
            "pN",
            _stall(records, name, ratchet, quick),
            Rule(3.0, 0.01, 0.02),
            float(_force(STALL, ratchet.monomer)),
        )
        for name, ratchet in _STALLS.items()
    ]
    speeds = {}
    for diffusion, stiffness in _STIFFNESSES.items():
        for share in _SHARES:
            ratchet = Ratchet(STALL * share, diffusion, stiffness=stiffness)
            own = _speed(records, f"speed-{diffusion:g}-{share:g}", ratchet, quick)
            speeds[diffusion, share] = own
            name = f"speed_at_{share:g}_of_the_stall_force,_D_=_{diffusion:g}"
            results.append(Result(name, "1", own, Rule(3.0, 0.05, 0.05), exact_speed(ratchet)))
    rows, exact = [], exact_speed(Ratchet(1.0))
    for step in _STEPS:
        own = _speed(records, f"step-{step:g}", Ratchet(1.0, step=step), quick)
        rows.append(f"| {step:g} | {own.value / exact:.3f} ± {own.error / exact:.3f} |")
    stalls = {name: _force(STALL, length) for name, length in _MONOMERS.items()}
    remarks = _ON_RATCHETS.format(steps="\n".join(rows), temperature=TEMPERATURE, **stalls)
    title = "Speeds of ends that push planes, with standard errors, against the load"
    return Outcome(results, {title: lambda figure: _draw(figure, speeds)}, remarks)


CASES = (Case("ratchets", "Stall forces, and speeds against loads", (), evaluate),)
