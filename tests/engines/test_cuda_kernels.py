"""Kernels for CUDA compile without a device, and the registers of a GPU suffice for them.

Where the packages with the compilers are not installed, nothing is tested here, unless OPENMM_CYLCHAIN_TEST_CUDA asks
for it: ``pip install --no-deps OpenMM-CUDA-12 nvidia-cuda-nvrtc-cu12 nvidia-cuda-nvcc-cu12`` brings them.
"""

import os

import pytest

from support.cuda_compiler import MISSING, compile_to_ptx, resources_of
from support.gpu_sources import BY_GROUP, BY_ITEM, BY_PART, COUPLINGS, OTHERS, PARTICLES, USUAL, source_of

if MISSING and os.environ.get("OPENMM_CYLCHAIN_TEST_CUDA"):
    raise RuntimeError(f"kernels for CUDA cannot be compiled without {', '.join(MISSING)}")

pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")

# Bytes that a change may spill, and keep on the stack, in an A100. There were 1404 and 432 at the last change. Kernels
# whose functions are called spill less, but took 1.1 to 3 times as long on an H200: registers hold no numbers across a
# call, and what is read through a pointer may be in any memory.
LARGEST_SPILLS, LARGEST_STACK = 1600, 500
BY = {"item": BY_ITEM, "group": BY_GROUP, "part": BY_PART}


@pytest.mark.parametrize("by", BY)
def test_registers_suffice(by, tmp_path):
    ptx = compile_to_ptx(source_of("CUDA", (*USUAL, *BY[by]), "mixed"), "compute_80")
    found = resources_of(ptx, "sm_80", tmp_path)
    if by == "item":
        forces = found.pop("computeForces")
        assert forces["registers"] <= 96 and forces["spills"] == 0
    assert set(found) == {"advanceChains"}
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
@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("precision", OTHERS)
def test_kernels_of_other_chains_compile(precision, by):
    ptx = compile_to_ptx(source_of("CUDA", (*OTHERS[precision], *BY[by]), precision), "compute_70")
    assert ".entry advanceChains" in ptx and (".entry computeForces" in ptx) == (by == "item")
