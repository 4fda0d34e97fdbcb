"""Contacts that differ between filaments of a file: other diameters, and filaments that nothing touches."""

import json
from pathlib import Path

import numpy as np
import pytest

from openmm_cylchain import InputError, analysis, find_contacts
from openmm_cylchain.couplings.capsule_contacts import as_capsule_contact_force
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.created_simulation import begin, create_simulation
from openmm_cylchain.runs.initial_state import build_system, recommended_step
from openmm_cylchain.runs.relaxation import relaxed_positions
from openmm_cylchain.runs.run import run
from openmm_cylchain.runs.run_directory import RunDirectory
from support import rod_cases
from support.contexts import positions_of
from support.rod_cases import PAIR
from support.rod_monte_carlo import linked_pair
from support.rod_observables import check, observe
from support.rod_simulations import PICONEWTON_PER_NANOMETER
from support.solvent import KT

REFERENCES = json.loads((Path(rod_cases.__file__).parent / "rod_references.json").read_text())

HEAD = """
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[contacts]
diameter = "20 nm"
stiffness = "5 pN/nm"
relax = false
[simulation]
scheme = "implicit"
time_step = "1 us"
duration = "0.2 ms"
report_interval = "20 us"
checkpoint_interval = "40 us"
seed = 5
platform = "CPU"
threads = 1
checks = false
"""


def rod(along, height, keys=""):
    """A rod of 100 nm across the axis z, with its middle on it."""
    ends = [[f"{sign * 50.0 * own} nm" for own in along] + [f"{height} nm"] for sign in (-1.0, 1.0)]
    return f'[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nnodes = {json.dumps(ends)}\n{keys}\n'


THIN, THICK, NONE = 'contact_diameter = "8 nm"', 'contact_diameter = "26 nm"', "contacts = false"


def contacts_of(text):
    configuration = parse_configuration(text)
    simulation, built = create_simulation(configuration)
    simulation.context.setPositions(built.positions)
    (force,) = filter(None, map(as_capsule_contact_force, built.system.getForces()))
    return force, find_contacts(force, simulation.context)


@pytest.mark.parametrize(
    ("first", "second", "distance"), [(THIN, THICK, 17.0), (THIN, "", 14.0), (THICK, "", 23.0), (THICK, THICK, 26.0)]
)
def test_filaments_touch_at_the_mean_of_their_diameters(first, second, distance):
    for gap in (-0.01, 0.01):
        text = HEAD + rod([1, 0], 0.0, first) + rod([0, 1], distance + gap, second) + rod([0.6, 0.8], 5.0, NONE)
        force, found = contacts_of(text)
        assert force.getNumChains() == 2
        assert found.gaps == pytest.approx([gap] * (gap < 0), abs=1e-9)
        assert found.forces == pytest.approx([5.0 * PICONEWTON_PER_NANOMETER * -gap] * (gap < 0))


@pytest.mark.sample("^1")
@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.0, 0.1])
def test_rods_of_different_diameters_have_the_equilibrium_of_draws(factor, tmp_path):
    """Of pairs on a spring, of 10 and 50 nm, as two of 30 nm; beside each pair is a rod that nothing touches."""
    copies, apart = 400, 3000.0
    middles, along, weights = linked_pair(PAIR, 3000, 7)
    kept = np.random.default_rng(8).random(len(weights)) < weights
    origins = apart * np.stack([*np.divmod(np.arange(copies), 20), np.zeros(copies)], axis=1)
    nodes = middles[kept][:copies, :, None] + np.array([-0.5, 0.5])[:, None] * along[kept][:copies, :, None]
    nodes = np.concatenate([nodes, nodes[:, :1]], axis=1) + origins[:, None, None]
    text = HEAD[: HEAD.index("[contacts]")]
    for number, keys in enumerate(('contact_diameter = "10 nm"', 'contact_diameter = "50 nm"', NONE)):
        np.save(tmp_path / f"{number}.npy", nodes[:, number])
        text += f'[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nfile = "{number}.npy"\n{keys}\n'
    (link,) = PAIR.links
    for number in range(copies):
        pair = f"{{ filament = {number}, segment = 0, fraction = 0.5 }}"
        pair += f", {{ filament = {copies + number}, segment = 0, fraction = 0.5 }}"
        stiffness = link.stiffness * KT / PICONEWTON_PER_NANOMETER
        text += (
            f'[[link]]\nbetween = [{pair}]\nstiffness = "{stiffness} pN/nm"\nrest_length = "{link.rest_length} nm"\n'
        )
    text += f'[contacts]\nstiffness = "{PAIR.contact * KT / PICONEWTON_PER_NANOMETER} pN/nm"\nrelax = false\n'
    text += '[simulation]\ntime_step = "recommended"\nduration = "2.4 ms"\nreport_interval = "2.4 ms"\n'
    text += 'seed = 1\nplatform = "CPU"\nthreads = 1\n'
    configuration = parse_configuration(text, tmp_path)
    simulation, built = create_simulation(configuration)
    simulation.context.setPositions(built.positions)
    step = factor * configuration.simulation.time_step
    simulation.integrator.setStepSize(step)
    interval = round(4e6 / step)
    simulation.step(75 * interval)
    total = 0.0
    for _ in range(600):
        simulation.step(interval)
        own = positions_of(simulation.context)[np.array(built.filaments.node_indices)].reshape(3, copies, 2, 3)[:2]
        own = own.swapaxes(0, 1)
        total = total + observe(PAIR, own.mean(axis=2), own[:, :, 1] - own[:, :, 0])
    check(PAIR, total / 600, *np.transpose(list(REFERENCES["pair"].values())))


def positions_after(text, steps):
    configuration = parse_configuration(text)
    simulation, built = create_simulation(configuration)
    begin(configuration, simulation, built)
    simulation.step(steps)
    return [positions_of(simulation.context)[nodes] for nodes in built.filaments.node_indices]


def test_what_nothing_touches_does_not_feel_contacts_of_others():
    """To the bit, though it lies across filaments that push each other."""
    ends = [[f"{own} nm" for own in end] for end in ((-100.0, -80.0, 3.0), (0.0, 0.0, 3.0), (100.0, 80.0, 3.0))]
    free = rod([1, 0], 0.0, NONE)
    free = free[: free.index("nodes")] + f"nodes = {json.dumps(ends)}\n{NONE}\n"
    apart = rod([1, 0], 500.0, THIN) + rod([0, 1], 900.0, THICK)
    touching = rod([1, 0], 0.0, THIN) + rod([0, 1], 10.0, THICK)
    far, near, alone = (
        positions_after(text, 100)
        for text in (HEAD + apart + free, HEAD + touching + free, HEAD + (touching + free).replace(THIN, NONE))
    )
    assert np.array_equal(far[2], near[2]) and np.array_equal(far[2], alone[2])
    assert not np.array_equal(near[0] + [0, 0, 500], far[0])


def test_overlaps_come_apart_but_for_what_nothing_touches():
    text = HEAD.replace("relax = false", "relax = true").replace('"0.5 pN/nm"', '"5 pN/nm"')
    text += rod([1, 0], 0.0, THIN) + rod([0, 1], 2.0, THICK) + rod([0.8, 0.6], 1.0, THICK) + rod([0.6, 0.8], 1.0, NONE)
    configuration = parse_configuration(text)
    built = build_system(configuration, None, 1)
    simulation, built = create_simulation(configuration)
    simulation.context.setPositions(relaxed_positions(configuration, built))
    (force,) = filter(None, map(as_capsule_contact_force, built.system.getForces()))
    found = find_contacts(force, simulation.context)
    assert np.all(0.5 * found.forces * np.abs(found.gaps) < 6 * KT)
    heights = [positions_of(simulation.context)[nodes][:, 2].mean() for nodes in built.filaments.node_indices]
    # In any order, but at least so far from each other.
    assert np.diff(np.sort(heights[:3])).min() > 12.0


def test_filaments_fill_a_box_with_their_own_diameters():
    head = HEAD.replace("relax = false", "relax = true") + '[box]\nedges = ["450 nm", "450 nm", "450 nm"]\n'
    many = '[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nsegments = 1\ncount = 700\n'
    full = parse_configuration(f'{head}{many}{THICK}\n{many}contact_diameter = "52 nm"\n{many}{NONE}\n')
    share = 700 * 100.0 * np.pi / 4.0 * (26.0**2 + 52.0**2) / 450.0**3
    with pytest.raises(InputError, match=f"filaments of up to 52 nm would fill {100 * share:.0f} % of the box"):
        relaxed_positions(full, build_system(full, None, 1))


def test_beam_elements_have_beads_by_their_own_diameters():
    beam = '[[filament]]\nname = "BEAM"\nelement = "beam"\ndiameter = "8 nm"\nsegment_length = "1 um"\n'
    beam += 'persistence_length = "5 um"\nstretching_modulus = "10 nN"\nsegments = 2\n'
    built = build_system(parse_configuration(HEAD + "".join(beam + own + "\n" for own in (THIN, THICK, NONE))), None, 1)
    counts = [len(own) for own in built.filaments.bead_indices]
    assert counts[0] > counts[1] > 0 == counts[2]


MONOMERS = """
[[monomers]]
name = "fast"
length = "2.7 nm"
plus_on_rate = "1e6 1/(uM*s)"
plus_off_rate = "2e5 1/s"
concentration = "1 uM"
"""
GROWS = 'growth = { monomers = "fast", longest = "2 um", minus_capped = true }\n'


def growing(height, keys):
    return rod([1, 0], height, keys).replace('"100 nm"', '"54 nm"').replace("50.0", "27.0") + GROWS


@pytest.mark.parametrize(("keys", "passes"), [(THIN, False), (NONE, True)])
def test_growing_ends_are_in_the_way_of_what_they_touch_alone(keys, passes):
    """A filament that grows along x, and stalls at 2.5 pN, towards a rod across its way, which is held."""
    ends = [["120 nm", f"{own} nm", "0 nm"] for own in (-50, 50)]
    text = HEAD + MONOMERS + growing(0.0, f"{keys}\nclamped = [0]\nplanar = true")
    text += f'[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nnodes = {json.dumps(ends)}\n{THICK}\n'
    text += "planar = true\n"
    for node in (0, 1):
        text += f'[[tether]]\nfilament = 1\nnode = {node}\nstiffness = "10 pN/nm"\n'
    farthest = positions_after(text, 60)[0][:, 0].max()
    assert farthest > 130.0 if passes else 95.0 < farthest < 110.0


def test_recommended_steps_are_of_growing_ends_that_touch_something():
    """A monomer comes in 1 us, of which a fifth may come in a step where the end pushes."""
    text = HEAD + MONOMERS + rod([0, 1], 500.0, THICK)
    reasons = []
    for keys in (THIN, NONE):
        configuration = parse_configuration(text + growing(0.0, keys))
        step = recommended_step(configuration, "implicit", None, 1)
        reasons.append(any("plus end of filament 1 gains 1e+06" in name for name in step.allowed))
    assert reasons == [True, False]


def test_branches_begin_where_they_touch_their_mothers():
    def distances(mothers, branches):
        text = HEAD + MONOMERS + "".join(growing(100.0 * number, own) for number, own in enumerate(mothers))
        found = []
        for own in branches:
            table = f'[[branching]]\ncount = 3\nrate = "1 1/(um*s)"\n{own}\n'
            found.append(parse_configuration(text + table).filaments[-1].nucleation.distance)
        return found

    own = f'type = "F_ACTIN"\nsegment_length = "54 nm"\n{GROWS}'
    assert distances([THIN, THICK], ["table = 1\nmothers = [1]", "table = 1\nmothers = [2]", "table = 1"]) == [
        8,
        17,
        17,
    ]
    assert distances([THIN, NONE], ["table = 1\nmothers = [2]", "table = 2", own + THICK, own + NONE]) == [0, 0, 26, 0]
    assert distances([""], ["table = 1", own + THICK + "\nmothers = [1]"]) == [20, 23]


def test_filaments_that_begin_have_the_diameter_of_their_table():
    text = HEAD + '[box]\nedges = ["1 um", "1 um", "1 um"]\n' + MONOMERS + growing(0.0, THICK)
    text += '[[nucleation]]\ntable = 1\ncount = 2\nrate = "1 nM/s"\n'
    text += f'[[nucleation]]\ncount = 2\nrate = "1 nM/s"\ntype = "F_ACTIN"\nsegment_length = "54 nm"\n{GROWS}'
    diameters = [own.contact_diameter for own in parse_configuration(text + THIN).filaments]
    assert diameters == [26.0, 26.0, 8.0]
    assert parse_configuration(text).filaments[-1].contact_diameter == 20.0
    assert parse_configuration(text + NONE).filaments[-1].contact_diameter is None
    with pytest.raises(InputError, match="contact_diameter is that of the table whose number is given"):
        parse_configuration(text.replace("table = 1\n", f"table = 1\n{THIN}\n"))


def test_a_run_that_is_loaded_has_the_contacts_of_its_own_filaments(tmp_path):
    """Behind one that nothing touches: at the start, at which the second and the third overlap by 1 nm."""
    text = HEAD + rod([0.6, 0.8], 3.0, NONE) + rod([1, 0], 0.0, THIN) + rod([0, 1], 16.0, THICK)
    run(parse_configuration(text), tmp_path / "out")
    loaded = analysis.load(tmp_path / "out")
    found = loaded.contacts(0)
    assert found.filaments.tolist() == [[1, 2]] and found.gaps == pytest.approx([-1.0], abs=1e-4)
    assert found.forces / PICONEWTON_PER_NANOMETER == pytest.approx([5.0], abs=1e-3)
    assert loaded.contact_forces["load (pN)"][0] == pytest.approx([0.0, 5.0, 5.0], abs=1e-3)


@pytest.mark.parametrize("step", ["0.1 us", "100 us"])
def test_steps_with_soft_and_hard_contacts_know_the_mean_alone(step):
    """Of a rod that 5 pN press on another one across, which is held: of 8 and 26 nm as of 17 nm both."""
    head = HEAD.replace('"1 us"', f'"{step}"').replace('"0.2 ms"', '"20 ms"')
    head = head.replace('"20 us"', '"1 ms"').replace('"40 us"', '"1 ms"')
    for node in (0, 1):
        point = ["0 nm", f"{100 * node - 50} nm", "12 nm"]
        head += f'[[tether]]\nfilament = 0\nnode = {node}\nstiffness = "20 pN/nm"\n'
        head += f'[[tether]]\nfilament = 1\nnode = {node}\nstiffness = "0.5 pN/nm"\npoint = {json.dumps(point)}\n'
    both = 'contact_diameter = "17 nm"'
    mixed, uniform = (
        positions_after(head + rod([1, 0], 0.0, first) + rod([0, 1], 17.0, second), 50)
        for first, second in ((THIN, THICK), (both, both))
    )
    np.testing.assert_allclose(mixed, uniform, atol=1e-6)
    distance = np.mean(mixed[1][:, 2]) - np.mean(mixed[0][:, 2])
    assert 14.0 < distance < 18.0


STAGES = """
[[stage]]
name = "thin"
duration = "80 us"
[[stage]]
name = "wide"
duration = "80 us"
pieces = 2
[stage.filament.1]
contact_diameter = { from = "8 nm", to = "16 nm" }
[stage.filament.3]
contacts = true
[[stage]]
name = "none"
duration = "80 us"
[stage.contacts]
active = false
"""


def test_contacts_of_filaments_change_in_stages_and_runs_go_on(tmp_path, monkeypatch):
    text = HEAD.replace('duration = "0.2 ms"\n', "") + "".join(
        rod(along, height, keys)
        for along, height, keys in (([1, 0], 0.0, THIN), ([0, 1], 16.0, THICK), ([0.6, 0.8], 30.0, NONE))
    )
    configuration = parse_configuration(text + STAGES)
    diameters = [[own.contact_diameter for own in stage.configuration.filaments] for stage in configuration.stages]
    assert diameters == [[8, 26, None], [10, 26, 20], [14, 26, 20], [None] * 3]
    run(configuration, tmp_path / "whole")
    loads = analysis.load(tmp_path / "whole").contact_forces["load (pN)"]
    assert loads[:5, 2].max() == 0.0 < loads[5:9, 2].max() and not loads[9:].any()
    assert loads[:5, 0] == pytest.approx(loads[:5, 1]) and loads[0, 0] == pytest.approx(5.0)
    write = RunDirectory.write_checkpoint

    def writes(directory, checkpoint):
        write(directory, checkpoint)
        raise KeyboardInterrupt

    monkeypatch.setattr(RunDirectory, "write_checkpoint", writes)
    while True:
        try:
            run(configuration, tmp_path / "broken", resume=True)
        except KeyboardInterrupt:
            continue
        break
    for name in ("trajectory.dcd", "energies.csv", "contact_forces.csv"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "broken" / name).read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("[contacts]\n", '[contacts]\nactive = "no"\n'), "active must be true or false"),
        (("8 nm", "0.1 nm"), r"line 22: .* contact_diameter is 0.1 nm, but filaments are 6 nm thick"),
        (("8 nm", "8 pN"), r"line 22: .* contact_diameter has the unit pN"),
        (('diameter = "20 nm"\n', ""), r"line 4: \[contacts\] lacks the key 'diameter'"),
    ],
)
def test_mistakes_are_named(change, message):
    text = HEAD.lstrip() + rod([1, 0], 0.0, THIN) + rod([0, 1], 900.0, "")
    with pytest.raises(InputError, match=message):
        parse_configuration(text.replace(*change, 1))


def test_a_diameter_needs_contacts():
    text = HEAD[: HEAD.index("[contacts]")] + HEAD[HEAD.index("[simulation]") :] + rod([1, 0], 0.0, THIN)
    with pytest.raises(InputError, match=r"contact_diameter belongs to \[contacts\]: add that table"):
        parse_configuration(text)
    later = text + "[contacts]\nactive = false\n"
    assert parse_configuration(later).filaments[0].contact_diameter is None
    # Without a diameter for all, where each has its own or none.
    head = HEAD.replace('diameter = "20 nm"\n', "")
    parse_configuration(head + rod([1, 0], 0.0, THIN) + rod([0, 1], 500.0, NONE))
