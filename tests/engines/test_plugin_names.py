"""The names of models, schemes and precisions: those of the plugin are those of the package."""

import pytest

from openmm_cylchain.engines import compiled
from openmm_cylchain.engines.compiled import CylinderChainForce, CylinderChainIntegrator


def test_numbers_are_those_of_the_enumerations():
    assert compiled.BENDING_MODELS["kratky-porod"] == CylinderChainForce.KratkyPorod
    assert compiled.BENDING_MODELS["inscribed-circle"] == CylinderChainForce.InscribedCircle
    assert compiled.STRETCHING_MODELS == {"harmonic": CylinderChainForce.Harmonic, "fene": CylinderChainForce.FENE}
    assert compiled.SCHEMES["implicit-second-order"] == CylinderChainIntegrator.ImplicitSecondOrder
    assert compiled.PRECISIONS["double"] == CylinderChainIntegrator.Double


def test_plugin_that_knows_other_names_is_refused():
    with pytest.raises(ImportError, match="the plugin has the bending models a, b, but the package a, c. Install"):
        compiled._numbers(("a", "b"), ("a", "c"), "bending models")
