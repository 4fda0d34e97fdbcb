"""Kernels for CUDA compile without a device, and the registers of a GPU suffice for them.

Where the packages with the compilers are not installed, nothing is tested here, unless OPENMM_CYLCHAIN_TEST_CUDA asks
for it: ``pip install --no-deps OpenMM-CUDA-12 nvidia-cuda-nvrtc-cu12 nvidia-cuda-nvcc-cu12`` brings them.
"""

import os

import pytest

from support.cuda_compiler import MISSING, compile_to_ptx, resources_of
from support.gpu_sources import COUPLINGS, OTHERS, PARTICLES, USUAL, source_of

if MISSING and os.environ.get("OPENMM_CYLCHAIN_TEST_CUDA"):
    raise RuntimeError(f"kernels for CUDA cannot be compiled without {', '.join(MISSING)}")

pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")

# Bytes that a change may spill, and keep on the stack, in an A100. There were 236 and 256 at the last change; the most
# registers that there can be are 255.
LARGEST_SPILLS, LARGEST_STACK = 300, 300


def test_registers_suffice(tmp_path):
    ptx = compile_to_ptx(source_of("CUDA", USUAL, "mixed"), "compute_80")
    found = resources_of(ptx, "sm_80", tmp_path)
    assert set(found) == {"advanceChains", "computeForces"}
    assert found["computeForces"]["registers"] <= 96 and found["computeForces"]["spills"] == 0
    assert found["advanceChains"]["spills"] <= LARGEST_SPILLS, found
    assert found["advanceChains"]["stack"] <= LARGEST_STACK, found


@pytest.mark.parametrize("precision", OTHERS)
def test_kernels_of_particles_compile(precision, tmp_path):
    found = resources_of(
        compile_to_ptx(source_of("CUDA", (), precision, "compile", "particles"), "compute_80"), "sm_80", tmp_path
    )
    assert set(found) == set(PARTICLES)
    assert all(one["spills"] == 0 for one in found.values()), found


@pytest.mark.parametrize("precision", OTHERS)
def test_kernels_of_couplings_compile(precision, tmp_path):
    found = resources_of(
        compile_to_ptx(source_of("CUDA", (), precision, "compile", "couplings", "contacts"), "compute_80"),
        "sm_80",
        tmp_path,
    )
    assert set(found) == set(COUPLINGS)
    assert all(one["spills"] == 0 and one["registers"] <= 168 for one in found.values()), found


@pytest.mark.slow
@pytest.mark.parametrize("precision", OTHERS)
def test_kernels_of_other_chains_compile(precision):
    ptx = compile_to_ptx(source_of("CUDA", OTHERS[precision], precision), "compute_70")
    assert ".entry advanceChains" in ptx and ".entry computeForces" in ptx
