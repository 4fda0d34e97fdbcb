"""A few steps of filaments on one of OpenMM's platforms for GPUs, beside those on the Reference platform.

``openmm-cylchain info`` runs it as a program of its own, because a driver may take down the program that calls it, and
a platform that is enabled stays so.
"""

import os
import subprocess
import sys

import numpy as np
import openmm

from ..engines.gpu_platforms import enable_platform, why_not_on
from ..errors import InputError
from ..filaments.presets import F_ACTIN
from ..systems.filaments import Filaments

_STEPS, _STEP_SIZE, _SEED = 5, 2e6, 1
# nm. OpenMM adds forces on GPUs in units of 2^-32 kJ/(mol nm), and nodes move by tens of nm here.
_TOLERANCE = 1e-5
_SECONDS = 300


def try_platform(name: str) -> str:
    """What comes of filaments on a platform for GPUs on this machine, in words."""
    reason = why_not_on(name)
    if reason is not None:
        return f"missing: {reason}"
    command = [sys.executable, "-m", __name__, name]
    try:
        # Python looks for modules in the folder it is run in, which may be a source tree.
        result = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False, cwd=sys.prefix)
    except subprocess.TimeoutExpired:
        return f"present, but {_STEPS} steps have not ended in {_SECONDS} s"
    said = (result.stdout if result.returncode == 0 else result.stdout + result.stderr).strip().splitlines()
    if result.returncode != 0:
        return f"present, but fails: {said[-1] if said else f'exit code {result.returncode}'}"
    return f"present, tested: {said[-1]}"


def _positions_after_steps(name, properties):
    filaments = Filaments(1030.0, 310.0, engine="compiled")
    for seed in range(2):
        filaments.add_equilibrium(F_ACTIN.with_segment_length(60.0), 10, seed=seed, start=[0.0, 100.0 * seed, 0.0])
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(
        system, _STEP_SIZE, "implicit", random_seed=_SEED, precision="double", checks=False
    )
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform(name), properties)
    context.setPositions(positions)
    integrator.step(_STEPS)
    return context.getState(positions=True).getPositions(asNumpy=True)._value


def _main(name):
    os.environ["OPENMM_DEFAULT_PLATFORM"] = "Reference"
    try:
        enable_platform(name)
        found = _positions_after_steps(name, {"Precision": "double"})
    except (InputError, openmm.OpenMMException) as error:
        print(error)
        return 1
    difference = np.abs(found - _positions_after_steps("Reference", {})).max()
    if not difference < _TOLERANCE:
        print(f"after {_STEPS} steps, positions differ by {difference:.1g} nm from those on the Reference platform")
        return 1
    print(f"{_STEPS} steps agree with those on the Reference platform (to {difference:.0e} nm)")
    return 0


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1]))
