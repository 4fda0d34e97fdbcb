"""Programs for GPUs as the plugin puts them together, behind what OpenMM puts before them.

That is in OpenMM's library for the platform, from its package for CUDA or HIP.
"""

import re
from pathlib import Path

import openmm

from support.repository import ROOT

_KERNELS = ROOT / "plugin_src" / "platforms" / "common" / "kernels"
_HOST = ROOT / "plugin_src" / "platforms" / "common" / "src" / "CommonCylinderChains.cpp"

USUAL = ("BENDING_InscribedCircle=1", "STRETCHING_Harmonic=1")
"""Defines of most filaments."""

OTHERS = {
    "single": ("BENDING_Quadratic=1", "STRETCHING_Harmonic=1"),
    "mixed": ("BENDING_KratkyPorod=1", "STRETCHING_FENE=1", "PLANAR=1"),
    "double": ("BENDING_BondDifference=1", "STRETCHING_Harmonic=1", "CLOSED=1"),
}
"""Defines of others, by the precisions in which they are compiled."""

BY_ITEM = ("ITEMS_OF_CHAIN=1",)
"""Defines of kernels in which one work-item advances a filament."""


def _by_group(items, chains, local_fields):
    return (
        "CHAIN_BY_GROUP=1",
        f"ITEMS_OF_CHAIN={items}",
        f"CHAINS_OF_GROUP={chains}",
        "NUM_PLACES=72",
        f"NUM_LOCAL_FIELDS={local_fields}",
    )


BY_GROUP = _by_group(32, 1, 73)
"""Of kernels in which a group of work-items takes the implicit steps of a filament of up to 70 nodes."""

BY_PART = _by_group(8, 4, 11)
"""The same, by parts of groups, on CUDA."""

PARTICLES = ("gatherNodes", "scatterForces", "moveNodes", "displaceOthers", "moveOthers")
"""The kernels of particles and nodes."""

COUPLINGS = ("gatherParticles", "finishForces", "computeLinks", "computeWalls", "countMoved", "computeContacts")
"""The kernels of links, walls and contacts."""


def library_of_openmm(platform):
    """The path of OpenMM's library for a platform, or None if its package is not installed."""
    path = Path(openmm.__file__).parents[1] / "OpenMM.libs" / "lib" / "plugins" / f"libOpenMM{platform}.so"
    return path if path.exists() else None


def _text_of_openmm(platform, marker):
    """The source text in OpenMM's library for a platform that contains a marker."""
    texts = [text for text in library_of_openmm(platform).read_bytes().split(b"\0") if marker in text]
    assert len(texts) == 1, f"{len(texts)} texts in OpenMM's library for {platform} have {marker!r}"
    return texts[0].decode()


def source_of(platform, defines=(), precision="double", program="programFor", *more):
    """A program as the host puts it together, with more kernels, behind what OpenMM puts before it."""
    host = re.search(rf"::{program}\(.*?\n}}\n", _HOST.read_text(), re.DOTALL).group()
    parts = "".join((_KERNELS / f"{name}.cc").read_text() for name in [*re.findall(r"Sources::(\w+)", host), *more])
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
        + "".join(f"#define {define.replace('=', ' ')}\n" for define in defines)
        + _text_of_openmm(platform, b"inline __device__ double3 make_double3(double a)")
        + parts
    )
