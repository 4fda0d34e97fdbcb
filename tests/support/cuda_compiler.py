"""Kernels for CUDA, compiled without a device as OpenMM would: by NVRTC to PTX, and by ptxas to what a GPU runs.

Both are in packages of NVIDIA on the package index.
"""

import ctypes
import re
import subprocess
from importlib.util import find_spec
from pathlib import Path

from support.gpu_sources import library_of_openmm


def _in_package(package, pattern):
    spec = find_spec("nvidia")
    folders = spec.submodule_search_locations if spec is not None else []
    found = [path for folder in folders for path in sorted((Path(folder) / package).glob(pattern))]
    return found[0] if found else None


_NVRTC = _in_package("cuda_nvrtc", "lib/libnvrtc.so.*")
_PTXAS = _in_package("cuda_nvcc", "bin/ptxas")

MISSING = [
    name
    for name, path in (
        ("OpenMM-CUDA-12", library_of_openmm("CUDA")),
        ("nvidia-cuda-nvrtc-cu12", _NVRTC),
        ("nvidia-cuda-nvcc-cu12", _PTXAS),
    )
    if path is None
]
"""The packages that are not installed."""


def compile_to_ptx(source, architecture):
    """The PTX of a source; AssertionError with what NVRTC says if it does not compile."""
    nvrtc = ctypes.CDLL(str(_NVRTC))
    program = ctypes.c_void_p()
    assert nvrtc.nvrtcCreateProgram(ctypes.byref(program), source.encode(), b"kernels.cu", 0, None, None) == 0
    # The options of OpenMM's CudaContext.
    options = [f"--gpu-architecture={architecture}", "--use_fast_math", "-std=c++11"]
    texts = (ctypes.c_char_p * len(options))(*(option.encode() for option in options))
    result = nvrtc.nvrtcCompileProgram(program, len(options), texts)
    size = ctypes.c_size_t()
    nvrtc.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetProgramLog(program, log)
    assert result == 0, log.value.decode()[:4000]
    nvrtc.nvrtcGetPTXSize(program, ctypes.byref(size))
    ptx = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetPTX(program, ptx)
    return ptx.value.decode()


def resources_of(ptx, architecture, folder):
    """Registers, bytes of stack and of spilled registers of each kernel."""
    file = folder / "kernels.ptx"
    file.write_text(ptx)
    result = subprocess.run(
        [_PTXAS, "--verbose", f"--gpu-name={architecture}", "--output-file", folder / "kernels.cubin", file],
        capture_output=True,
        text=True,
        check=True,
    )
    found = {}
    for text in result.stderr.split("Compiling entry function")[1:]:
        name = re.match(r" '(\w+)'", text).group(1)
        stack = re.search(r"(\d+) bytes stack frame", text).group(1)
        spills = re.findall(r"(\d+) bytes spill stores, (\d+) bytes spill loads", text)
        found[name] = {
            "registers": int(re.search(r"Used (\d+) registers", text).group(1)),
            "stack": int(stack),
            "spills": sum(int(stores) + int(loads) for stores, loads in spills),
        }
    return found
