"""Kernels for HIP compile without a device, for GPUs of AMD's two families.

Where compilers and packages are not installed, nothing is tested here, unless OPENMM_CYLCHAIN_TEST_HIP asks for it.
"""

import os

import pytest

from support.gpu_sources import KERNELS, PRECISIONS, source_of
from support.hip_compiler import MISSING, scratch_of

if MISSING and os.environ.get("OPENMM_CYLCHAIN_TEST_HIP"):
    raise RuntimeError(f"kernels for HIP cannot be compiled without {', '.join(MISSING)}")

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")]


@pytest.mark.parametrize("precision, architecture", [*((one, "gfx90a") for one in PRECISIONS), ("mixed", "gfx1030")])
def test_kernels_compile(precision, architecture, tmp_path):
    found = scratch_of(source_of("HIP", precision), architecture, tmp_path)
    assert set(found) == set(KERNELS) and not any(found.values())
