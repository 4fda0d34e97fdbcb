"""Programs for GPUs as the plugin puts them together, behind what OpenMM puts before them.

That is in OpenMM's library for the platform, from its package for CUDA or HIP.
"""

from pathlib import Path

import openmm

from support.repository import ROOT

_KERNELS = ROOT / "plugin_src" / "platforms" / "common" / "kernels"

KERNELS = (
    "copyToProcessor",
    "addForces",
    "copyFromProcessor",
    "sumWork",
    "displaceParticles",
    "moveParticles",
)
PRECISIONS = ("single", "mixed", "double")


def library_of_openmm(platform):
    """The path of OpenMM's library for a platform, or None if its package is not installed."""
    path = Path(openmm.__file__).parents[1] / "OpenMM.libs" / "lib" / "plugins" / f"libOpenMM{platform}.so"
    return path if path.exists() else None


def _text_of_openmm(platform, marker):
    """The source text in OpenMM's library for a platform that contains a marker."""
    texts = [text for text in library_of_openmm(platform).read_bytes().split(b"\0") if marker in text]
    assert len(texts) == 1, f"{len(texts)} texts in OpenMM's library for {platform} have {marker!r}"
    return texts[0].decode()


def source_of(platform, precision):
    """The program as the host puts it together, behind what OpenMM puts before it."""
    parts = "".join((_KERNELS / f"{name}.cc").read_text() for name in ("layout", "noise", "particles"))
    real, mixed = ("double", "double") if precision == "double" else ("float", "float")
    if precision == "mixed":
        mixed = "double"
    types = "".join(
        f"typedef {kind}{count} {name}{count};\n"
        + (f"#define make_{name}{count} make_{kind}{count}\n" if count else "")
        for name, kind in (("real", real), ("mixed", mixed))
        for count in ("", "2", "3", "4")
    )
    switch = {"double": "#define USE_DOUBLE_PRECISION 1\n", "mixed": "#define USE_MIXED_PRECISION 1\n", "single": ""}
    return (
        switch[precision]
        + types
        + _text_of_openmm(platform, b"#define KERNEL extern")
        + _text_of_openmm(platform, b"inline __device__ double3 make_double3(double a)")
        + parts
    )
