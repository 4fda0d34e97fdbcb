"""Kernels for HIP compile without a device, for GPUs of AMD's two families.

Where compilers and packages are not installed, nothing is tested here, unless OPENMM_CYLCHAIN_TEST_HIP asks for it.
"""

import os

import pytest

from support.gpu_sources import BY_GROUP, BY_ITEM, COUPLINGS, OTHERS, PARTICLES, USUAL, source_of
from support.hip_compiler import MISSING, scratch_of

if MISSING and os.environ.get("OPENMM_CYLCHAIN_TEST_HIP"):
    raise RuntimeError(f"kernels for HIP cannot be compiled without {', '.join(MISSING)}")

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")]

CHAINS = [("mixed", USUAL, "gfx90a"), ("mixed", USUAL, "gfx1030")]
CHAINS += [(precision, defines, "gfx90a") for precision, defines in OTHERS.items()]


@pytest.mark.parametrize("precision, defines, architecture", CHAINS)
def test_kernels_of_chains_compile(precision, defines, architecture, tmp_path):
    found = scratch_of(source_of("HIP", (*defines, *BY_ITEM), precision), architecture, tmp_path)
    assert set(found) == {"advanceChains", "computeForces"}
    found = scratch_of(source_of("HIP", (*defines, *BY_GROUP), precision), architecture, tmp_path)
    assert set(found) == {"advanceChains"}


@pytest.mark.parametrize("precision", OTHERS)
def test_other_kernels_compile(precision, tmp_path):
    found = scratch_of(source_of("HIP", (), precision, "compile", "particles"), "gfx90a", tmp_path)
    assert set(found) == set(PARTICLES) and not any(found.values())
    found = scratch_of(source_of("HIP", (), precision, "compile", "couplings", "contacts"), "gfx90a", tmp_path)
    assert set(found) == set(COUPLINGS)
