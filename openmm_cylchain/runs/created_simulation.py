"""The Simulation of a configuration, and where its run begins."""

import openmm
from openmm import app

from ..engines.gpu_platforms import GPU_PLATFORMS, enable_platform
from ..errors import InputError
from ..systems.refused_context import refusal
from ..time_steps.precision import PRECISIONS
from .countless_events import refuse_countless_events
from .errors_of_tables import located_errors
from .initial_state import build_system
from .relaxation import relaxed_positions


@located_errors
def create_simulation(configuration, begun=None, number=0, deleted=frozenset()):
    """The Simulation of a configuration, without positions, and its BuiltSystem.

    Of a stage of a run, with the Filaments of the first one, whose places are taken, its number, and the numbers of
    filaments that have been deleted; what has noise of its own in each Context gets another seed in each.

    InputError if it cannot be built, or the platform cannot simulate it.
    """
    settings = configuration.simulation
    built = build_system(configuration, settings.engine, settings.seed, begun=begun, deleted=deleted)
    filaments = built.filaments
    refuse_countless_events(configuration, filaments)
    platform, properties = platform_of(settings, filaments.engine)
    integrator = filaments.create_integrator(
        built.system,
        settings.time_step,
        scheme=settings.scheme,
        random_seed=settings.seed if filaments.engine == "compiled" else (settings.seed + number) % 2**31 or 1,
        checks=settings.checks,
        precision=_of_filaments(settings, filaments.engine) or "automatic",
        **built.arguments(),
    )
    try:
        return app.Simulation(built.topology, built.system, integrator, platform, properties), built
    except openmm.OpenMMException as error:
        raise refusal(error, built.system, integrator, platform) from None


def stage_simulation(stage, first, deleted=frozenset()):
    """The same of a Stage; ``first`` is that of the first one, whose filaments begin where these do."""
    return create_simulation(stage.configuration, first[1].filaments, stage.number, deleted)


@located_errors
def begin(configuration, simulation, built):
    """Bring a Simulation of a configuration to where the run begins, and return the positions."""
    positions = relaxed_positions(configuration, built)
    if configuration.relaxes and configuration.linkers:
        # Linkers may begin elsewhere now.
        simulation.context.reinitialize()
    simulation.context.setPositions(positions)
    return positions


def _of_filaments(settings, engine):
    # The precision if it is that of filaments. Others are of the platform, and so is any with the portable engine, and
    # on GPUs.
    own = engine == "compiled" and settings.platform not in GPU_PLATFORMS
    return settings.precision if own and settings.precision in PRECISIONS else None


def platform_of(settings, engine):
    """The Platform of the settings of a run, and its properties; InputError if it cannot be had."""
    if engine == "compiled" and settings.platform in GPU_PLATFORMS:
        try:
            enable_platform(settings.platform)
        except InputError as error:
            raise InputError(f'[simulation] platform: {error} "Reference" always can.') from None
    names = [openmm.Platform.getPlatform(index).getName() for index in range(openmm.Platform.getNumPlatforms())]
    if settings.platform not in names:
        raise InputError(
            f"[simulation] platform must be one of those that OpenMM has loaded, {', '.join(names)}, but is "
            f"{settings.platform!r}."
        )
    platform = openmm.Platform.getPlatformByName(settings.platform)
    properties = {}
    # Forces must be summed in a fixed order for a resumed run to be identical to an unbroken one.
    if "DeterministicForces" in platform.getPropertyNames():
        properties["DeterministicForces"] = "true"
    if settings.precision not in (None, "automatic") and _of_filaments(settings, engine) is None:
        if "Precision" not in platform.getPropertyNames():
            raise InputError(
                f"[simulation] precision cannot be chosen on the platform {settings.platform}: leave it out."
            )
        properties["Precision"] = settings.precision
    if settings.threads is not None:
        properties["Threads"] = str(settings.threads)
    return platform, properties
