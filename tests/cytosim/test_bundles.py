"""Bundles of Cytosim: fibers that overlap, and the links that join them."""

import numpy as np
import pytest

from openmm_cylchain.errors import InputError
from openmm_cylchain.runs.created_simulation import begin, create_simulation
from openmm_cylchain.runs.initial_state import build_system
from support.cytosim_files import MICROMETER, SYSTEM, TUBE, translated

# Steps are those of Cytosim, which resolve less.
pytestmark = pytest.mark.filterwarnings("ignore::openmm_cylchain.TimeStepWarning")

PN_PER_UM = 0.602214076e-3


def bundle(keys, made):
    return TUBE + f"set bundle pair {{ overlap = 0.2; stiffness = 500; {keys} }}\nnew {made}\n"


def ends_of(found):
    """Of all filaments, first and last nodes in um."""
    return np.array([own.positions[[0, -1]] for own in build_system(found, None, 1).filaments]) / MICROMETER


@pytest.mark.parametrize(("keys", "pole"), [("", 0), ("focus = plus_end", 1)])
def test_two_fibers_overlap_at_one_of_their_ends(tmp_path, keys, pole):
    made = "2 pair { fibers = 2, tube, ( length = 1.5 ); position = 1 0 0; direction = 0 1 0 }"
    found, document = translated(tmp_path, bundle(keys, made))
    assert document.missing == []
    ends = ends_of(found)
    assert ends.shape == (4, 2, 3)
    directions = (ends[:, 1] - ends[:, 0]) / 1.5
    np.testing.assert_allclose(directions, [[0, 1, 0], [0, -1, 0]] * 2, atol=1e-6)
    # Poles are beyond the middle of the overlap by half of it: plus ends along the fibers, minus ends against them.
    sign = 1 if pole else -1
    np.testing.assert_allclose(ends[:, pole], [1, 0, 0] + sign * 0.1 * directions, atol=1e-6)
    # Cytosim joins neighbours, and the last one with the first one: the same two again.
    assert len(found.links) == 8
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    simulation.step(200)
    positions = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value / MICROMETER
    for first, second in ((0, 1), (2, 3)):
        nodes = [positions[built.filaments.node_indices[own]] for own in (first, second)]
        nodes = [own[::-1] if pole else own for own in nodes]
        for one, other in (nodes, nodes[::-1]):
            # A length of 0.2 um along, in segments of 0.5 um: within a few lengths of (kT/1000 pN/um)^(1/2).
            place = other[0] + 0.4 * (other[1] - other[0])
            assert np.linalg.norm(one[0] - place) < 0.01


def test_rings_close_and_lengths_are_of_each_fiber(tmp_path):
    made = "pair { fibers = 3, tube, ( length = 1 ); length = 1, 2, 1.5; position = 0 0 0; direction = 1 0 0 }"
    found, document = translated(tmp_path, bundle("", made))
    assert document.missing == []
    ends = ends_of(found)
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), [1, 2, 1.5], atol=1e-6)
    joined = [
        tuple(sorted(end["filament"] for end in table.value("between"))) for table in document.tables_called("[[link]]")
    ]
    assert joined == [(0, 1)] * 2 + [(1, 2)] * 2 + [(0, 2)] * 2
    # The third one points as the first one does: ends with ends.
    between = [table.value("between") for table in document.tables_called("[[link]]")][-2:]
    assert [["node" in end for end in pair] for pair in between] == [[True, True], [False, False]]
    assert found.links[0].stiffness == pytest.approx(500 * PN_PER_UM)


@pytest.mark.parametrize(("flat", "size", "apart"), [(True, 2, [1, 1]), (True, 3, [1, 1, 2]), (False, 3, [1, 1, 1])])
def test_fibers_that_touch_are_bound_side_by_side(tmp_path, flat, size, apart):
    """With contacts, in a row in a plane and else around a circle: links are as long as fibers are apart."""
    text = bundle("", f"pair {{ fibers = {size}, tube, ( length = 1 ); position = 1 0 0; direction = 0 1 0 }}")
    text = text.replace("rigidity", "steric = 1, 0.02; rigidity", 1)
    system = SYSTEM.replace("dim = 3", f"steric = 1, 100; dim = {2 if flat else 3}")
    found, document = translated(tmp_path, text, system)
    assert document.missing == []
    ends = ends_of(found)
    pairs = [(own, (own + 1) % size) for own in range(size)]
    across = ends.mean(axis=1) * [1, 0, 1]
    np.testing.assert_allclose(across.mean(axis=0), [1, 0, 0], atol=1e-6)
    distances = [np.linalg.norm(across[first] - across[second]) for first, second in pairs]
    np.testing.assert_allclose(distances, 0.04 * np.array(apart), rtol=1e-6)
    np.testing.assert_allclose([own.rest_length for own in found.links], 40.0 * np.repeat(apart, 2), rtol=1e-6)
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    simulation.step(200)


def test_bundles_that_cannot_be_said(tmp_path):
    growing = "set fiber tube { rigidity = 20; activity = grow; growing_speed = 1 }\nset fiber rod { rigidity = 20 }\n"
    text = growing + "set bundle pair { overlap = 0.2; stiffness = 500 }\nnew rod { length = 1 }\n"
    _, document = translated(tmp_path, text + "new 3 pair { fibers = 2, tube, ( length = 1 ) }\n")
    assert document.missing == ["bundles of fibers that grow"]
    with pytest.raises(InputError, match="fibers of new pair must have from 1 to 100 fibers"):
        translated(tmp_path, bundle("", "pair { fibers = 0, tube }"))
    with pytest.raises(InputError, match="there is no fiber called ''"):
        translated(tmp_path, bundle("", "pair"))
