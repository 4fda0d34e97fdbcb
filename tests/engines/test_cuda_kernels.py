"""Kernels for CUDA compile without a device, and the registers of a GPU suffice for them.

Where the packages with the compilers are not installed, nothing is tested here, unless OPENMM_CYLCHAIN_TEST_CUDA asks
for it: ``pip install --no-deps OpenMM-CUDA-12 nvidia-cuda-nvrtc-cu12 nvidia-cuda-nvcc-cu12`` brings them.
"""

import os

import pytest

from support.cuda_compiler import MISSING, compile_to_ptx, resources_of
from support.gpu_sources import KERNELS, PRECISIONS, source_of

if MISSING and os.environ.get("OPENMM_CYLCHAIN_TEST_CUDA"):
    raise RuntimeError(f"kernels for CUDA cannot be compiled without {', '.join(MISSING)}")

pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")


@pytest.mark.parametrize("precision", PRECISIONS)
def test_kernels_compile(precision, tmp_path):
    found = resources_of(compile_to_ptx(source_of("CUDA", precision), "compute_80"), "sm_80", tmp_path)
    assert set(found) == set(KERNELS)
    assert all(one["spills"] == 0 for one in found.values()), found
