"""Kernels for CUDA compile without a device, and the registers of a GPU suffice for them.

Where the packages with the compilers are not installed, nothing is tested here, unless OPENMM_CYLCHAIN_TEST_CUDA asks
for it: ``pip install --no-deps OpenMM-CUDA-12 nvidia-cuda-nvrtc-cu12 nvidia-cuda-nvcc-cu12`` brings them.
"""

import os

import pytest

from support.cuda_compiler import MISSING, compile_to_ptx, resources_of
from support.gpu_sources import BY_GROUP, COUPLINGS, OTHERS, PARTICLES, USUAL, source_of

if MISSING and os.environ.get("OPENMM_CYLCHAIN_TEST_CUDA"):
    raise RuntimeError(f"kernels for CUDA cannot be compiled without {', '.join(MISSING)}")

pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")

# Bytes that a change may spill, and keep on the stack, in an A100. There were 40 and 216 at the last change, and in the
# kernel of groups 204 and 304, nearly all of them where functions are called once in a step; the most registers that
# there can be are 255.
LARGEST_SPILLS, LARGEST_STACK = 80, 260
LARGEST_SPILLS_OF_GROUPS, LARGEST_STACK_OF_GROUPS = 260, 360

# What work-items of a group do from node to node, one after the other: what these spill is waited for at each node.
ALONG_THE_CHAIN = ("eliminateFromEnd", "substitute", "refine", "addMetricForces")


def test_registers_suffice(tmp_path):
    ptx = compile_to_ptx(source_of("CUDA", USUAL, "mixed"), "compute_80")
    found = resources_of(ptx, "sm_80", tmp_path)
    assert set(found) == {"advanceChains", "computeForces"}
    assert found["computeForces"]["registers"] <= 96 and found["computeForces"]["spills"] == 0
    assert found["advanceChains"]["spills"] <= LARGEST_SPILLS, found
    assert found["advanceChains"]["stack"] <= LARGEST_STACK, found


def test_registers_suffice_for_groups(tmp_path):
    ptx = compile_to_ptx(source_of("CUDA", (*USUAL, BY_GROUP), "mixed"), "compute_80")
    found = resources_of(ptx, "sm_80", tmp_path)
    assert set(found) == {"advanceChains"}
    advance = found["advanceChains"]
    assert advance["spills"] <= LARGEST_SPILLS_OF_GROUPS and advance["stack"] <= LARGEST_STACK_OF_GROUPS, found
    assert all(advance["functions"][name] <= 16 for name in ALONG_THE_CHAIN), found


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
    ptx = compile_to_ptx(source_of("CUDA", (*OTHERS[precision], BY_GROUP), precision), "compute_70")
    assert ".entry advanceChains" in ptx
