"""Fig. 5: the three bending potentials."""

import numpy as np

from benchmark.measurement import Estimate
from openmm_cylchain.filaments.filament_type import FilamentType

from . import simulation, style
from .case import Case, Outcome
from .result import Result, Rule

_RULE = Rule(0.0, 1e-6)
_LENGTH, _STIFFNESS, _RIGIDITY = 360.0, 1000.0, 100.0
_MODELS = {
    "kratky-porod": ("A, Kratky–Porod (26)", lambda angle: 1 - np.cos(angle)),
    "quadratic": ("B, quadratic", lambda angle: 0.5 * angle**2),
    "inscribed-circle": ("C, inscribed circle (27)", lambda angle: 2 * np.tan(0.5 * angle) ** 2),
}


def bending_energies(model, angles):
    """Energies over a/l0 that the engine finds for a joint bent by the given angles: {"energies": array}."""
    kind = FilamentType(
        name="BEND",
        diameter=6.0,
        segment_length=_LENGTH,
        bending_rigidity=_RIGIDITY,
        stretching_stiffness=_STIFFNESS,
        bending_model=model,
    )
    filaments = simulation.solvent()
    filaments.add_nodes(kind, _bent(0.0))
    context = simulation.start(filaments, 1.0, 1)
    energies = []
    for angle in angles:
        context.setPositions(_bent(angle))
        energies.append(context.getState(energy=True).getPotentialEnergy()._value / kind.joint_stiffness)
    return {"energies": energies}


def _bent(angle):
    return _LENGTH * np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]])


def evaluate(records, quick):
    """Energies at three angles, and the curves."""
    angles = np.linspace(0.0, 0.97 * np.pi, 98)
    degrees = (30, 90, 150)
    results, curves = [], {}
    for model, (_, formula) in _MODELS.items():
        name = model.replace("-", "_")
        curves[model] = records.measure(
            f"figure-05-{model}", bending_energies, model=model, angles=[*angles, *np.radians(degrees)]
        )["energies"]
        for degree, energy in zip(degrees, curves[model][-len(degrees) :]):
            ours = Estimate(float(energy), None)
            results.append(
                Result(f"{name}_at_{degree}_degrees", "a/l0", ours, _RULE, float(formula(np.radians(degree))))
            )

    def draw(figure):
        axis = figure.subplots()
        for colour, (model, (label, formula)) in zip(style.COLOURS, _MODELS.items()):
            axis.plot(angles / np.pi, formula(angles), color=colour, label=f"case {label}")
            axis.plot(angles[::5] / np.pi, curves[model][: len(angles) : 5], "o", markersize=3.5, color=colour)
        axis.plot([], [], "o", markersize=3.5, color="gray", label="ours, from the engine")
        style.finish(axis, r"angle $\vartheta/\pi$", r"energy $V_\mathrm{b}/V_0$", xlim=(0, 1), ylim=(0, 10))

    return Outcome(results, {"Bending potentials": draw})


CASES = (Case("figure-05", "Fig. 5: three bending potentials", (5,), evaluate),)
