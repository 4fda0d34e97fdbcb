"""What the end of a run says that it was for."""

import json

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import MICROTUBULE, analysis
from openmm_cylchain.cli import main
from openmm_cylchain.scans.quantities import read_quantities

PROPELLED = """
[solvent]
temperature = "310 K"
viscosity = "1 mPa*s"
[[filament]]
type = "MICROTUBULE"
segments = 3
count = 9
planar = true
propulsion = "{force}"
[simulation]
time_step = "1 ms"
duration = "1 s"
report_interval = "10 ms"
seed = 3
checks = false
"""


def finished(tmp_path, text):
    (tmp_path / "input.toml").write_text(text)
    assert main(["run", str(tmp_path / "input.toml"), "--output", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    return {own["name"]: own for own in summary.get("measures", [])}


@pytest.mark.parametrize(("force", "end"), [("0.2 pN", "last node (plus end)"), ("-0.2 pN", "first node (minus end)")])
def test_speed_of_filaments_that_glide(tmp_path, capsys, force, end):
    """Of a force on each of its segments, over their friction; they diffuse by a percent of what they glide."""
    own = finished(tmp_path, PROPELLED.format(force=force))[f"gliding speed, {end} ahead"]
    friction = MICROTUBULE.segment_friction(1e-3 * unit.pascal * unit.second, 310.0, 3).parallel
    expected = 0.2 * 0.602214076 / friction * 1e12
    assert own["unit"] == "nm/s" and own["standard_error"] < 0.02 * expected
    assert abs(own["mean"] - expected) < 4.0 * own["standard_error"]
    said = capsys.readouterr().out
    assert f"gliding speed, {end} ahead (nm/s)" in said and "nematic order of filaments" in said
    assert "not comparable" not in said
    (found,) = [one for one in read_quantities(tmp_path / "out" / "summary.json") if one.name.startswith("gliding")]
    assert (found.of, found.value) == ("all filaments", own["mean"])


def test_measures_of_a_network(tmp_path, capsys):
    """Ten filaments in a sphere; what joins them is found once more, from the places of linkers."""
    text = PROPELLED.replace("segments = 3\ncount = 9\nplanar = true\n", SPHERE).replace('propulsion = "{force}"\n', "")
    found = finished(tmp_path, text.replace('"1 s"', '"0.2 s"') + WALL_AND_LINKERS)
    run = analysis.load(tmp_path / "out")
    radii = [np.sqrt(np.var(np.concatenate(run.nodes(frame)), axis=0).sum()) for frame in (0, -1)]
    own = found["radius of gyration of all filaments"]
    np.testing.assert_allclose((own["first"], own["last"]), radii, rtol=1e-6)
    assert own["last"] / own["first"] == pytest.approx(analysis.contraction(run)[-1])
    groups = [{number} for number in range(len(run.filaments))]
    for one, other in run.linkers[len(run) - 1]["filaments"]:
        if min(one, other) >= 0 and groups[one] is not groups[other]:
            joined = groups[one] | groups[other]
            for number in joined:
                groups[number] = joined
    largest = max(map(len, groups))
    own = found["share of filaments in the largest joined network"]
    assert own["first"] == 0.0 and own["last"] == pytest.approx(largest / len(groups)) and largest > 1
    vectors = np.concatenate([np.diff(nodes, axis=0) for nodes in run.nodes(-1)])
    order = found["nematic order of filaments"]["last"]
    assert order == pytest.approx(analysis.order_parameter(vectors), rel=1e-6)
    assert 0.0 <= found["share of filaments in bundles"]["last"] <= 1.0
    loads = run.wall_forces["load (pN)"][10:].sum(axis=1)
    assert found["sum of forces of walls"]["mean"] == pytest.approx(loads.mean())
    said = capsys.readouterr().out
    assert said.count("so they are not compared") == 1 and "energy per bend (kT)" in said


SPHERE = 'segments = [3, 4]\nsegment_length = "200 nm"\ncount = 10\ninside = { shape = "sphere", radius = "1 um" }\n'
WALL_AND_LINKERS = """
[[wall]]
shape = "sphere"
radius = "1 um"
stiffness = "0.1 pN/nm"
[[linkers]]
name = "crosslinker"
stiffness = "0.02 pN/nm"
rest_length = "50 nm"
hand = { binding_rate = "100 1/s", reach = "150 nm", unbinding_rate = "1 1/s" }
count = 300
"""


def test_free_filaments_have_none(tmp_path):
    assert finished(tmp_path, PROPELLED.replace('propulsion = "{force}"\n', "").replace('"1 s"', '"20 ms"')) == {}
