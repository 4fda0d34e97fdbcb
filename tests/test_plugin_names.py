"""The names of models, schemes and precisions: those of the plugin are those of the package."""

import pytest

from openmm_cylchain.engines import native
from openmm_cylchain.engines.native import CylinderChainForce, CylinderChainIntegrator


def test_numbers_are_those_of_the_enumerations():
    assert native.BENDING_MODELS["kratky-porod"] == CylinderChainForce.KratkyPorod
    assert native.BENDING_MODELS["inscribed-circle"] == CylinderChainForce.InscribedCircle
    assert native.STRETCHING_MODELS == {"harmonic": CylinderChainForce.Harmonic, "fene": CylinderChainForce.FENE}
    assert native.SCHEMES["implicit-second-order"] == CylinderChainIntegrator.ImplicitSecondOrder
    assert native.PRECISIONS["double"] == CylinderChainIntegrator.Double


def test_plugin_that_knows_other_names_is_refused():
    with pytest.raises(ImportError, match="the plugin has the bending models a, b, but the package a, c. Install"):
        native._numbers(("a", "b"), ("a", "c"), "bending models")
