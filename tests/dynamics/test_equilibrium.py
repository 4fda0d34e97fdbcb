"""Equilibrium of chains against exact values, for every engine, platform and scheme."""

from dataclasses import replace

import pytest

from openmm_cylchain.theory import chain_mean_square_end_to_end, wlc_mean_square_end_to_end
from support.equilibrium_cases import CASES, Case, exact_means, measured_means, soft_chain
from support.platforms import ENGINE_PLATFORMS, ENGINES, ENGINES_PORTABLE_SLOW
from support.solvent import KT, TEMPERATURE

SIGMAS = 4.0
# Of the step's own error: an explicit scheme of weak order one makes the variance of a mode of rate lambda too large
# by lambda dt/2, which is at most 1 % at a hundredth of the stability bound.
STEP_ERROR = 0.01


def _deviations(case, measured):
    exact = exact_means(case)
    deviations = {}
    for name in exact:
        mean, error = measured[name]
        excess = abs(mean - exact[name])
        if name.endswith("energy"):
            excess = max(0.0, excess - STEP_ERROR * exact[name])
        deviations[name] = excess / error
    return deviations


def _check(name, engine, platform):
    case = CASES[name]
    measured = measured_means(case, engine, platform, "midpoint")
    exact = exact_means(case)
    for energy in ("stretching energy", "bending energy"):
        if energy in measured:
            assert 0.05 * exact[energy] > SIGMAS * measured[energy][1], f"too few samples to see 5 % of {energy}"
    deviations = _deviations(case, measured)
    assert max(deviations.values()) < SIGMAS, (deviations, measured, exact)


@pytest.mark.sample("f-actin|compiled")
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("engine", ENGINES_PORTABLE_SLOW)
def test_midpoint_keeps_equilibrium(name, engine):
    _check(name, engine, "Reference")


@pytest.mark.sample("compiled|freely-jointed-portable-OpenCL")
@pytest.mark.slow
@pytest.mark.parametrize(("engine", "platform"), [pair for pair in ENGINE_PLATFORMS if pair[1] != "Reference"])
@pytest.mark.parametrize("name", CASES)
def test_midpoint_keeps_equilibrium_on_platform(name, engine, platform):
    _check(name, engine, platform)


# The bias of DNA's segment length, 0.08 %, is 4.4 standard errors of the case as it is.
MORE_CHAINS = {"dna-8nm": 3}


@pytest.mark.sample("compiled|f-actin")
@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("engine", ENGINES)
def test_printed_scheme_fails(name, engine):
    case = replace(CASES[name], chains=CASES[name].chains * MORE_CHAINS.get(name, 1))
    deviations = _deviations(case, measured_means(case, engine, "Reference", "euler"))
    assert max(deviations.values()) > SIGMAS, deviations


# Contour length over persistence length, with the segments that resolve it and the chains that measure it.
END_TO_END = [(0.05, 16, 150), (0.2, 16, 150), (1.0, 32, 300), pytest.param(5.0, 24, 2200, marks=pytest.mark.slow)]


@pytest.mark.sample("^(?!portable-5)")
@pytest.mark.parametrize(("ratio", "segments", "chains"), END_TO_END)
@pytest.mark.parametrize("engine", ENGINES_PORTABLE_SLOW)
def test_drawn_chains_keep_their_end_to_end_distance(engine, ratio, segments, chains):
    length = 100.0
    kind = soft_chain("WLC", bending_rigidity=KT * segments * length / ratio)
    case = Case(kind, segments, chains, 100, 0.02)
    mean, error = measured_means(case, engine, "Reference", "midpoint")["squared end-to-end distance"]
    exact = chain_mean_square_end_to_end(kind, segments, TEMPERATURE)
    assert abs(mean - exact) < SIGMAS * error
    assert 0.05 * exact > SIGMAS * error

    # A joint of the inscribed-circle model is stiffer than a length l0 of wormlike chain by O(l0/l_p), and thermal
    # stretching lengthens segments by a percent each.
    wormlike = wlc_mean_square_end_to_end(segments * length, segments * length / ratio)
    discretisation = 1.5 * ratio / segments + 2 * (exact_means(case)["length"] - 1.0)
    assert abs(mean - wormlike) < SIGMAS * error + discretisation * wormlike
