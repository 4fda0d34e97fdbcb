"""Why OpenMM has refused a Context: the System, or the platform."""

import openmm

from ..errors import InputError


def refusal(
    error: openmm.OpenMMException,
    system: openmm.System,
    integrator: openmm.Integrator,
    platform: openmm.Platform | None,
) -> InputError:
    """The InputError for an exception with which a Context was refused; None is the platform that OpenMM chooses.

    Another platform is to blame if the Reference platform takes the System.
    """
    if platform is not None and platform.getName() != "Reference" and _fits_reference(system, integrator):
        return InputError(
            f'The platform "{platform.getName()}" cannot simulate this: {error}. The platform "Reference" can.'
        )
    return InputError(f"This cannot be simulated: {error}.")


def _fits_reference(system, integrator):
    try:
        openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    except openmm.OpenMMException:
        return False
    return True
