"""What cannot run is refused in words before it begins, and what can run does."""

from types import SimpleNamespace

import numpy as np
import openmm
import pytest
from openmm import app

from openmm_cylchain import InputError, InstabilityError
from openmm_cylchain.cli import main
from openmm_cylchain.runs import run as runs
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.keys import Place
from openmm_cylchain.runs.run import begin, check_step, create_simulation
from openmm_cylchain.runs.run_directory import RunDirectory
from openmm_cylchain.runs.stages import stages_of
from openmm_cylchain.runs.summarised_run import run_with_summary
from openmm_cylchain.runs.tables.shapes import REGION, Region
from support.run_figures import rendered

SOLVENT = '[solvent]\ntemperature = "300 K"\nviscosity = "1 mPa*s"\n'
BOX = '[box]\nedges = ["600 nm", "600 nm", "600 nm"]\n'
ACTIN = '[[filament]]\ntype = "F_ACTIN"\nsegment_length = "100 nm"\nsegments = 4\ncount = 2\n'
BEAMS = ACTIN + 'element = "beam"\n'
PARTICLES = '[[particles]]\ndiameter = "150 nm"\ncount = 2\n'
CONTACTS = '[contacts]\ndiameter = "10 nm"\n'
SIMULATION = '[simulation]\ntime_step = "100 ns"\nduration = "1 us"\nreport_interval = "100 ns"\n'
STIFF = """
[[filament]]
name = "ROD"
diameter = "25 nm"
segment_length = "100 nm"
segments = 4
bending_rigidity = "4e13 pN*nm^2"
stretching_modulus = "1e6 pN"
extension_relaxation_time = "1 ns"
friction_length = "filament"
"""


def parsed(*tables, filament=ACTIN, simulation=SIMULATION):
    return parse_configuration("".join([SOLVENT, filament, *tables, simulation + "checks = false\n"]))


def linkers(rates, more, name="m", reach=50):
    hand = f'hand = {{ reach = "{reach} nm", {rates} }}'
    return f'[[linkers]]\nname = "{name}"\nstiffness = "0.1 pN/nm"\n{hand}\n{more}\n'


def test_a_run_of_joints_too_stiff_for_a_grid_of_angles_has_its_figure(tmp_path):
    with rendered():
        groups, *_ = run_with_summary(parsed(filament=STIFF), tmp_path / "out")
    assert groups and (tmp_path / "out" / "summary.png").stat().st_size > 10**4


def test_a_box_too_narrow_for_contacts_is_not_the_fault_of_a_platform():
    message = r"^This cannot be simulated: The periodic box is too small for contacts in implicit steps: it is 800 nm"
    wide, thick = BOX.replace("600", "800"), CONTACTS.replace("10 nm", "200 nm")
    for platform in ("Reference", "CPU"):
        simulation = f'{SIMULATION}platform = "{platform}"\n'
        for call in (create_simulation, check_step):
            for relax in ("true", "false"):
                with pytest.raises(InputError, match=message):
                    call(parsed(wide, f"{thick}relax = {relax}\n", simulation=simulation))


def test_particles_run_beside_beams_with_contacts():
    configuration = parsed(BOX, PARTICLES.replace("150", "50"), CONTACTS, filament=BEAMS)
    simulation, built = create_simulation(configuration)
    begin(configuration, simulation, built)
    simulation.step(2)
    # That of particles, not of the beads on beams that come before them.
    sites = [built.system.isVirtualSite(i) for i in range(built.system.getNumParticles())]
    assert sum(sites) > 10 and len(built.particle_friction) == sum(sites) + 2
    assert np.all(built.particle_friction[-2:] == configuration.particles[0].friction)


def test_random_links_join_base_pairs():
    dna = '[[filament]]\ntype = "DSDNA_BASE_PAIRS"\nsegments = 40\ncount = 2\nstart = "straight"\n'
    link = '[[link]]\nwithin = "40 nm"\nstiffness = "1 pN/nm"\ncount = 9\n'
    assert build_system(parsed(link, filament=dna), None, 1).links == 9
    # An arc length counts along the straight chain.
    end = '[[link]]\nbetween = [{{ filament = 0, arc_length = "{} nm" }}, {{ filament = 1, node = 0 }}]\n'
    end += 'stiffness = "1 pN/nm"\n'
    length = parsed(filament=dna).filaments[0].type.straight_lengths(40).sum()
    assert build_system(parsed(end.format(length), filament=dna), None, 1).links == 1
    with pytest.raises(InputError, match="beyond the end of the filament"):
        parsed(end.format(1.001 * length), filament=dna)


ON_TOP = """
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
nodes = [["0 nm", "0 nm", "0 nm"], ["100 nm", "0 nm", "0 nm"], ["200 nm", "0 nm", "0 nm"]]
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
nodes = [["0 nm", "1 nm", "0 nm"], ["100 nm", "1 nm", "0 nm"], ["200 nm", "1 nm", "0 nm"]]
"""


@pytest.mark.parametrize(("reach", "found"), [(60, True), (5, False)])
def test_linkers_are_bound_where_overlaps_have_come_apart(reach, found):
    anchors = 'anchors = [["50 nm", "0 nm", "0 nm"], ["150 nm", "0 nm", "0 nm"]]\nbound = 2'
    bound = linkers('binding_rate = "0 1/s", unbinding_rate = "0 1/s"', anchors, reach=reach)
    configuration = parsed(bound, '[contacts]\ndiameter = "60 nm"\n', filament=ON_TOP)
    simulation, built = create_simulation(configuration)
    if not found:
        with pytest.raises(InputError, match="only [01] of the 2 anchors have a free place"):
            begin(configuration, simulation, built)
        return
    positions = begin(configuration, simulation, built)._value
    assert np.linalg.norm(positions[1] - positions[4]) > 30.0
    table = built.filaments.in_context(simulation.context).linkers()
    assert list(table.held) == [2, 2]
    for row, x in enumerate((50.0, 150.0)):
        nodes = positions[built.filaments.node_indices[table.filaments[row, 1]]]
        place = [np.interp(table.arc_lengths[row, 1], [0, 100, 200], column) for column in nodes.T]
        assert np.linalg.norm(np.array(place) - [x, 0, 0]) < 60.0 + 1e-6


@pytest.mark.parametrize(
    ("rates", "more", "message"),
    [
        (
            'binding_rate = "1e13 1/s", unbinding_rate = "1e13 1/s"',
            "count = 10",
            "a hand would bind and unbind about 1e",
        ),
        ('binding_rate = "1e9 1/s", unbinding_rate = "1e6 1/s"', 'concentration = "1 M"', "come out of their conc"),
    ],
)
def test_linkers_that_would_do_too_much_in_a_step_are_refused(rates, more, message):
    few = linkers('binding_rate = "1 1/s", unbinding_rate = "1e13 1/s"', "count = 1", "few")
    for call in (create_simulation, check_step):
        with pytest.raises(InputError, match=rf"^line 16: \[\[linkers\]\] number 2: .*{message}"):
            call(parsed(BOX, few, linkers(rates, more)))


def test_sites_that_no_filament_has_are_refused():
    rates = 'binding_rate = "1 1/s", unbinding_rate = "1 1/s", site_spacing = "{} nm"'
    with pytest.raises(InputError, match="'m': a hand has no sites, 401 nm apart, on filaments of 400 nm"):
        create_simulation(parsed(BOX, linkers(rates.format(401), "count = 1")))
    create_simulation(parsed(BOX, linkers(rates.format(400), "count = 1")))


@pytest.mark.parametrize(("model", "refused"), [('model = "fene"\nmaximum_extension = "20 nm"\n', True), ("", False)])
def test_fene_links_that_begin_out_of_range_are_refused(model, refused):
    places = "between = [{ filament = 0, node = 0 }, { filament = 1, node = 0 }]\n"
    link = f'[[link]]\n{places}stiffness = "1 pN/nm"\nrest_length = "10 nm"\n{model}'
    if refused:
        with pytest.raises(
            InputError, match=r"line \d+: \[\[link\]\] number 1: begins with a length of .* FENE spring"
        ):
            build_system(parsed(link), None, 1)
    else:
        assert build_system(parsed(link), None, 1).links == 1


def written(tmp_path, *tables):
    path = tmp_path / "own.toml"
    path.write_text("".join([SOLVENT, ACTIN, *tables, SIMULATION]))
    return str(path)


@pytest.mark.parametrize(("error", "code"), [(InstabilityError, 1), (openmm.OpenMMException, 1), (InputError, 2)])
def test_first_steps_that_fail_are_an_error_of_a_dry_run_and_of_a_run(tmp_path, capsys, monkeypatch, error, code):
    def fail(*arguments):
        raise error("Hands bind too often")

    monkeypatch.setattr(app.Simulation, "step", fail)
    for where in (["--dry-run"], ["--output", str(tmp_path / "out")]):
        assert main(["run", written(tmp_path), *where]) == code
        said = capsys.readouterr()
        assert "error: " in said.err and "Hands bind too often" in said.err
    assert "Traceback" not in said.err


class Clock:
    """Goes on as steps, motions of tethers, reports and checkpoints are done."""

    def __init__(self, patch, costs):
        self.now = 0.0
        patch.setattr(runs, "time", self)
        for owner, name, cost in costs:
            patch.setattr(owner, name, self._timed(getattr(owner, name), cost, by_number=name == "step"))

    def monotonic(self):
        return self.now

    process_time = monotonic

    def _timed(self, function, cost, by_number):
        def timed(*arguments):
            self.now += cost * (arguments[1] if by_number else 1)
            return function(*arguments)

        return timed


TETHER = '[[tether]]\nfilament = 0\nnode = 0\nstiffness = "1 pN/nm"\nvelocity = ["1 um/s", "0 um/s", "0 um/s"]\n'


@pytest.mark.parametrize("steps", [1, 8, 100])
def test_a_dry_run_counts_steps_reports_checkpoints_and_motions_of_tethers(tmp_path, monkeypatch, steps):
    simulation = f'[simulation]\ntime_step = "10 ns"\nduration = "8 us"\nreport_interval = "{10 * steps} ns"\n'
    configuration = parsed(TETHER, simulation=simulation)
    took = []
    for way in ("run_to_end", "seconds_of_run"):
        with monkeypatch.context() as patch:
            simulation, built = create_simulation(configuration)
            begin(configuration, simulation, built)
            recorder = runs.Recorder
            costs = (app.Simulation, "step", 1e-3), (recorder, "_report", 0.1), (recorder, "_write_checkpoint", 1.0)
            clock = Clock(patch, (*costs, (runs.MovingTethers, "move", 0.02)))
            (stage,) = stages_of(configuration)
            own = recorder(stage, built, simulation, RunDirectory(tmp_path), None)
            if way == "run_to_end":
                own.run_to_end(SimpleNamespace(received=None), SimpleNamespace(update=lambda step: None))
                took.append(clock.now)
            else:
                took.append(own.seconds_of_run(3.0)[1])
    assert 0.9 < took[1] / took[0] < 1.1


@pytest.mark.parametrize("power", [-0.2, 0.0, 0.05, 0.3, 0.8])
def test_a_dry_run_knows_that_steps_become_slower(power):
    """Of which linkers are the cause; what grows without bound is not believed in."""
    numbers = np.arange(0, 201, 5)
    growth = runs._growth(list(zip(numbers, 3.0 + 0.01 * numbers ** (1.0 + power))), 10.0)
    assert growth == pytest.approx({0.3: 10.0**0.3, 0.8: 3.0}.get(power, 1.0), rel=0.01)


def test_places_in_a_tilted_cylinder_are_drawn_at_once():
    """In a four-millionth of the box around it: uniform along its axis and over its cross section."""
    table = {
        "shape": "cylinder",
        "axis": [1, 1, 1],
        "radius": "1 nm",
        "length": "3 um",
        "point": ["5 nm", "0 nm", "0 nm"],
    }
    region, generator = Region(REGION.read(table, Place("inside", ()))), np.random.default_rng(1)
    points = np.array([region.draw(generator) for _ in range(4000)])
    assert region.contains(points)
    relative, axis = points - [5.0, 0.0, 0.0], np.ones(3) / np.sqrt(3.0)
    along = relative @ axis
    squares = np.sum((relative - along[:, None] * axis) ** 2, axis=1)
    # Means of 3000^2/12 and 1/2 of uniform squares, within four standard errors.
    for values, mean, deviation in ((along**2, 750000.0, 750000.0 * np.sqrt(0.8)), (squares, 0.5, np.sqrt(1.0 / 12.0))):
        assert abs(values.mean() - mean) < 4.0 * deviation / np.sqrt(4000)
    assert abs(along.mean()) < 4.0 * 3000.0 / np.sqrt(12.0 * 4000)


@pytest.mark.parametrize("unit", ["1 1/dB", "1 dB", "1 Np*s", "1 1/dBm"])
def test_logarithmic_units_are_refused(tmp_path, capsys, unit):
    path = tmp_path / "own.toml"
    path.write_text((SOLVENT + ACTIN + SIMULATION).replace("1 mPa*s", unit))
    assert main(["run", str(path), "--dry-run"]) == 2
    assert f"viscosity has the unit {unit.split(' ', 1)[1]}, which is not one of viscosity" in capsys.readouterr().err


def test_names_that_are_none_are_refused(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path, long = written(tmp_path), "a" * 300
    assert main(["run", path, "--output", ""]) == 2
    assert "output is an empty text" in capsys.readouterr().err
    for arguments in (["run", path, "--output", long], ["run", path, "--output", long, "--resume"]):
        assert main(arguments) == 1
        assert "File name too long" in capsys.readouterr().err
    assert main(["timestep", long]) == 2
    assert "cannot be read: File name too long" in capsys.readouterr().err
    (tmp_path / "start.toml").write_text(f'{SOLVENT}[[filament]]\ntype = "F_ACTIN"\nfile = "{long}.npy"\n{SIMULATION}')
    assert main(["run", "start.toml", "--dry-run"]) == 2
    assert "does not exist" in capsys.readouterr().err
    assert sorted(own.name for own in tmp_path.iterdir()) == ["own.toml", "start.toml"]


def test_a_topology_that_was_cut_off_is_named(tmp_path, capsys):
    path, output = written(tmp_path), tmp_path / "out"
    assert main(["run", path, "--output", str(output)]) == 0
    topology = (output / "topology.cif").read_bytes()
    for size in (0, 10, 1500, len(topology) - 200):
        (output / "topology.cif").write_bytes(topology[:size])
        capsys.readouterr()
        assert main(["run", path, "--output", str(output), "--resume"]) == 2
        assert "topology.cif is damaged" in capsys.readouterr().err
    (output / "topology.cif").write_bytes(topology)
    assert main(["run", path, "--output", str(output), "--resume"]) == 0


def test_messages_name_their_table_once(tmp_path, capsys):
    text = (SOLVENT + ACTIN + SIMULATION).replace("count = 2\n", "count = 2\nclamped = [99]\n")
    with pytest.raises(InputError) as caught:
        parse_configuration(text)
    assert str(caught.value).count("[[filament]] number 1") == 1


def test_every_warning_of_the_package_is_told_once(tmp_path, capsys):
    far = linkers('binding_rate = "1 1/s", unbinding_rate = "1 1/s"', "count = 1", reach=100)
    assert main(["run", written(tmp_path, BOX, far), "--dry-run"]) == 0
    told = capsys.readouterr()
    assert "\n    1 linker: m\n" in told.out
    said = told.err
    assert said.count("warning: Linkers 'm': a reach of 100 nm is far beyond") == 1 and "LinkerWarning" not in said


def test_trajectories_of_one_run_are_the_same_whenever_they_were_written(tmp_path, monkeypatch):
    found = []
    for date in (1e9, 1.5e9):
        with monkeypatch.context() as patch:
            patch.setattr(app.dcdfile.time, "time", lambda date=date: date)
            run_with_summary(parsed(), tmp_path / f"{date:g}")
        found.append((tmp_path / f"{date:g}" / "trajectory.dcd").read_bytes())
    assert found[0] == found[1]


FENE = '[[link]]\nbetween = [{ filament = 0, node = 0 }, { filament = 1, node = 0 }]\nstiffness = "1 pN/nm"\n'
FENE += 'rest_length = "1 nm"\nmodel = "fene"\nmaximum_extension = "2 nm"\n'
ITSELF = '[[link]]\nbetween = [{ filament = 0, node = 0 }, { filament = 0, node = 0 }]\nstiffness = "1 pN/nm"\n'
RANDOM = '[[link]]\nwithin = "{}"\nstiffness = "1 pN/nm"\n'
WALL = '[[wall]]\nshape = "sphere"\nradius = "70 nm"\nstiffness = "1 pN/nm"\n'
NARROW = '{ shape = "sphere", radius = "90 nm" }'
SITES = 'binding_rate = "1 1/s", unbinding_rate = "1 1/s", site_spacing = "300 nm"'


@pytest.mark.parametrize(
    ("before", "table", "at_fault", "message"),
    [
        (BOX, linkers(SITES, "count = 9\nbound = 9"), "[[linkers]]", "Linkers 'm': 9 are to begin bound"),
        (BOX, FENE, "[[link]]", "[[link]] number 1: begins with a length of"),
        ("", ITSELF, "[[link]]", "[[link]] number 1: Crosslink 0 joins particle 0 to itself."),
        (BOX, RANDOM.format("400 nm"), "within", "[[link]] number 1: within must be less than half"),
        ("", RANDOM.format("90 nm") + 'spacing = "0.01 pm"\n', "spacing", "[[link]] number 1: spacing makes 8e+07"),
        ("", RANDOM.format("9 um") + 'spacing = "0.1 nm"\n', "[[link]]", "[[link]] number 1: within is 9000 nm, where"),
        (BOX.replace("600", "210"), CONTACTS, "[contacts]", "[contacts] The periodic box is"),
        (BOX + PARTICLES, WALL, "radius", "[[wall]] number 1: a particle with a radius of 75 nm does not fit"),
        ("", ACTIN + f"inside = {NARROW}\n", "inside", "[[filament]] number 2: filament 2 of 4 segments does not fit"),
        ("", "", "platform", "[simulation] platform must be one of those that OpenMM has loaded"),
    ],
)
def test_what_is_built_is_refused_with_file_and_line(tmp_path, capsys, before, table, at_fault, message):
    file = tmp_path / "run.toml"
    platform = "SLIDE_RULE" if at_fault == "platform" else "CPU"
    file.write_text(f'{SOLVENT}{ACTIN}{before}{table}{SIMULATION}platform = "{platform}"\n')
    assert main(["run", str(file), "--dry-run"]) == 2
    line = 1 + [line.startswith(at_fault) for line in file.read_text().splitlines()].index(True)
    assert capsys.readouterr().err.splitlines()[-1].startswith(f"error: {file}, line {line}: {message}")
