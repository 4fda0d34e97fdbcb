"""Filaments that are drawn on top of each other come apart before a run begins."""

from openmm import Context, OpenMMException, Platform

from ..errors import InputError, InstabilityError
from .initial_state import build_system

# Lengths of steps in those of the run, first in the cold.
_COLD, _WARM = (1e-3, 1e-2, 0.1, 0.5), (0.1, 0.5, 1.0)
_STEPS = 20
_COLD_TEMPERATURE = 1.0


def relaxed_positions(configuration, built):
    """Positions in which a run begins: those of a BuiltSystem, or where contacts have pushed what overlapped.

    That takes 140 steps without linkers: in the cold, in steps that grow, and then at the temperature of the solvent.
    The result depends on the configuration alone.

    Raises
    ------
    InputError
        If they do not come apart.
    """
    if configuration.contacts is None or not configuration.contacts.relax:
        return built.positions
    settings, temperature = configuration.simulation, configuration.solvent.temperature
    alone = build_system(configuration, settings.engine, settings.seed, linkers=False)
    integrator = alone.filaments.create_integrator(
        alone.system,
        settings.time_step,
        scheme=settings.scheme,
        random_seed=settings.seed,
        checks=False,
        precision="double",
        **alone.arguments(),
    )
    context = Context(alone.system, integrator, Platform.getPlatformByName("Reference"))
    context.setPositions(built.positions)
    try:
        for bath, lengths in ((_COLD_TEMPERATURE, _COLD), (temperature, _WARM)):
            integrator.setTemperature(bath)
            for length in lengths:
                integrator.setStepSize(length * settings.time_step)
                integrator.step(_STEPS)
    except (InstabilityError, OpenMMException) as error:
        raise InputError(
            f"[contacts] filaments that overlap at first have not come apart: {error} Begin with fewer filaments, "
            "with a smaller diameter or time_step, or set relax = false."
        ) from None
    return context.getState(positions=True).getPositions(asNumpy=True)
