"""Systems whose equilibrium is known exactly, and the run that measures it, for every engine."""

from dataclasses import dataclass, replace

import numpy as np
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, FilamentType
from openmm_cylchain.filaments.equilibrium import JointAngleDistribution, SegmentLengthDistribution
from openmm_cylchain.time_steps.stability import stability_bounds
from support.bending_models import BENDING_MODELS
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

PICONEWTON = unit.piconewton
NANOMETER = unit.nanometer


def soft_chain(name, **bending):
    """Segments of 100 nm that stretch by a tenth; slow extension, so that few steps reach far."""
    base = FilamentType(name=name, diameter=6, segment_length=100, stretching_stiffness=100 * KT / 100**2, **bending)
    friction = base.segment_friction(VISCOSITY, TEMPERATURE)
    return replace(base, extensional_friction=4 * friction.rotational)


@dataclass(frozen=True)
class Case:
    """A system and how long to run it: ``fraction`` is the step over the smallest stability bound."""

    type: FilamentType
    segments: int
    chains: int
    steps: int
    fraction: float


CASES = {
    "freely-jointed": Case(soft_chain("FJC", bending_rigidity=0.0), 2, 1500, 2000, 0.01),
    **{
        model: Case(soft_chain("BEND", bending_rigidity=2 * KT * 100, bending_model=model), 8, 800, 1000, 0.01)
        for model in BENDING_MODELS
    },
    "fene": Case(
        replace(soft_chain("FENE", bending_rigidity=2 * KT * 100), stretching_model="fene", maximum_extension=50.0),
        8,
        800,
        1000,
        0.01,
    ),
    "f-actin-60nm": Case(
        replace(F_ACTIN, name="ACT60", segment_length=60.0, stretching_stiffness=292.2 * PICONEWTON / NANOMETER),
        32,
        120,
        1500,
        0.01,
    ),
    "dna-8nm": Case(
        FilamentType(
            name="DNA",
            diameter=2,
            segment_length=8,
            persistence_length=43.3,
            temperature=310,
            stretching_modulus=1100 * PICONEWTON,
            extension_relaxation_time=0.4 * unit.nanosecond,
        ),
        16,
        480,
        800,
        0.01,
    ),
}


def time_step(case):
    """The step of a case in ps."""
    return case.fraction * min(stability_bounds(case.type, VISCOSITY, TEMPERATURE, case.segments).values())


def exact_means(case):
    """Exact equilibrium means: energies in k_B T, lengths over the rest length."""
    kind = case.type
    lengths = SegmentLengthDistribution(kind, TEMPERATURE)
    cosines = JointAngleDistribution(kind, TEMPERATURE)
    means = {
        "stretching energy": lengths.mean(kind.stretching_energy) / KT,
        "length": lengths.mean(lambda length: length) / kind.segment_length,
        "cosine": cosines.mean(lambda cosine: cosine),
        "squared cosine": cosines.mean(lambda cosine: cosine**2),
    }
    if kind.bending_rigidity > 0:
        means["bending energy"] = cosines.mean(kind.bending_energy) / KT
    return means


def _observables(case, nodes):
    kind = case.type
    difference = np.diff(nodes, axis=1)
    length = np.linalg.norm(difference, axis=2)
    tangent = difference / length[..., None]
    cosine = np.einsum("ijk,ijk->ij", tangent[:, 1:], tangent[:, :-1])
    values = {
        "squared end-to-end distance": np.sum((nodes[:, -1:] - nodes[:, :1]) ** 2, axis=2),
        "stretching energy": kind.stretching_energy(length) / KT,
        "length": length / kind.segment_length,
        "cosine": cosine,
        "squared cosine": cosine**2,
    }
    if kind.bending_rigidity > 0:
        values["bending energy"] = kind.bending_energy(cosine) / KT
    return {name: value.mean(axis=1) for name, value in values.items()}


def measured_means(case, engine, platform, scheme, seed=20, step=None):
    """Means over independent chains with their standard errors: {name: (mean, error)}.

    Chains start from the exact equilibrium, so a run that keeps it needs no equilibration; the first
    quarter of the run lets a wrong scheme leave it. The step is that of the case if it is not given.
    """
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for chain in range(case.chains):
        filaments.add_equilibrium(case.type, case.segments, seed=chain)
    _, system, positions = filaments.build()
    step = time_step(case) if step is None else step
    integrator = filaments.create_integrator(system, step, scheme=scheme, random_seed=seed)
    context = new_context(system, positions, integrator, platform)
    integrator.step(case.steps // 4)
    samples = []
    for _ in range(50):
        integrator.step(case.steps * 3 // 200)
        nodes = positions_of(context).reshape(case.chains, case.segments + 1, 3)
        samples.append(_observables(case, nodes))
    result = {}
    for name in samples[0]:
        per_chain = np.mean([sample[name] for sample in samples], axis=0)
        result[name] = (per_chain.mean(), per_chain.std(ddof=1) / np.sqrt(len(per_chain)))
    return result
