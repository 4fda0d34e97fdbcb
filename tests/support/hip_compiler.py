"""Kernels for HIP, compiled by clang for GPUs of AMD without a device.

clang 15 or newer is needed (Debian and Ubuntu: clang-15), with the headers of HIP (libamdhip64-dev) and AMD's library
for devices (rocm-device-libs). OpenMM itself lets ROCm compile them when a program runs.
"""

import re
import shutil
import subprocess
from pathlib import Path

from support.gpu_sources import library_of_openmm

_CLANG = next((path for number in range(19, 14, -1) if (path := shutil.which(f"clang++-{number}"))), None)
_HEADER = Path("/usr/include/hip/hip_runtime.h")
_DEVICE_LIBRARY = Path("/usr/lib/x86_64-linux-gnu/amdgcn/bitcode")

MISSING = [
    name
    for name, there in (
        ("OpenMM-HIP-6", library_of_openmm("HIP")),
        ("clang-15", _CLANG),
        ("libamdhip64-dev", _HEADER.exists()),
        ("rocm-device-libs", _DEVICE_LIBRARY.exists()),
    )
    if not there
]
"""The packages that are not installed."""


def scratch_of(source, architecture, folder):
    """Bytes of scratch memory of each kernel in a source; AssertionError with what clang says where it is wrong."""
    program, assembly = folder / "kernels.hip", folder / "kernels.s"
    program.write_text("#include <hip/hip_runtime.h>\n" + source)
    paths = ["--rocm-path=/usr", f"--rocm-device-lib-path={_DEVICE_LIBRARY}"]
    options = ["--cuda-device-only", f"--offload-arch={architecture}", "-O3", "-ffast-math", "-std=c++14"]
    # As OpenMM's HipContext says.
    options += ["--gpu-max-threads-per-block=256", "-D__HIP_PLATFORM_AMD__"]
    command = [_CLANG, "-x", "hip", *paths, *options, "-S", "-o", assembly, program]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr[:4000]
    text = assembly.read_text()
    parts = text.split(".amdhsa_kernel ")[1:]
    return {part.split()[0]: int(re.search(r"; ScratchSize: (\d+)", part).group(1)) for part in parts}
