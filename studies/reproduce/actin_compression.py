"""A filament of actin whose ends are pushed together, beside Simularium's comparison of ReaDDy and Cytosim."""

import csv
import shutil
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from benchmark.measurement import Estimate
from openmm_cylchain import analysis
from openmm_cylchain.export.simularium import write_simularium
from openmm_cylchain.output.files import write_atomically
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.run import run
from openmm_cylchain.units.quantities import PICONEWTON, thermal_energy

from . import compressed_shapes, simulation, style
from .case import Case, Outcome
from .compressed_shapes import MEASURES, HeldElastica
from .result import Printed, Result, Rule

TITLE = "Simularium's comparison of compressed actin, with ours"
CITATION = (
    "B. Lyons, S. S. Mogre, K. Vegesna, J. S. Yu, M. Hansen, A. Raghunathan, G. T. Johnson, E. Agmon and M. Akamatsu, "
    "*Comparing simulations of actin filament compression reveals tradeoff between computational cost and capturing "
    "supertwist*, Allen Institute for Cell Science 2024, https://simularium.github.io/subcell-website"
)

_LENGTH, _SHORTENING = 500.0, 150.0
_RIGIDITY = 4.1e4
"""In pN nm^2."""
_TEMPERATURE = 304.2
"""At which k_B T is the 4.2 pN nm of Cytosim."""
_SEGMENTS = 50
_KEYS = {4.7: "0047", 15.0: "0150", 47.0: "0470", 150.0: "1500"}
_DURATIONS = {4.7: 31685.0, 15.0: 10000.0, 47.0: 3162.0, 150.0: 1000.0}
"""In us, by the name of the velocity in um/s: 150 nm over these."""
_FRAMES = 200
_FIRST = _FRAMES // 4
"""Means are over frames from here on, when the filament is buckled."""
_LATER = "0.25 to 1"
"""The same of theirs."""
_POINTS = 200
_SAVED = 5
"""Replicates of which there are files of points, as of theirs."""
_REPLICATES = {False: 20, True: 8}
_FINE = {False: (47.0, 150.0), True: (150.0,)}
"""Velocities that are simulated in ten times smaller steps too."""
_SERIES = "ACTIN_COMPRESSION_VELOCITY"
_HELD, _THEIRS_HELD = 5.0, 20.0 / 3.0
"""In nm, at each end, of the elastica that filaments are compared with: the direction of the first segment of 10 nm is
held, which is that of a filament at its middle; of theirs, points at 0 and 10 nm, between which it bends as a beam that
is supported twice, by a third as much as it would beyond."""
_CONFIGURATION = f"""title = "actin compressed at {{velocity:g}} um/s"

[solvent]
temperature = "{_TEMPERATURE} K"
viscosity = "10 mPa*s"

[[filament]]
name = "ACT"
count = {{replicates}}
segments = {_SEGMENTS}
segment_length = "{_LENGTH / _SEGMENTS:g} nm"
start = "straight"
position = ["0 nm", "0 nm", "0 nm"]
direction = [1, 0, 0]
diameter = "7 nm"
bending_rigidity = "{_RIGIDITY:g} pN*nm^2"
bending_model = "kratky-porod"
stretching_modulus = "4.4e4 pN"
friction_length = "filament"
{{tethers}}
[simulation]
time_step = {{time_step}}
duration = "{{duration:.9g}} us"
report_interval = "{{interval:.9g}} us"
platform = "CPU"
seed = 1
"""
_TETHER = """
[[tether]]
table = 1
node = {node}
stiffness = "1e4 pN/nm"
"""
_THERMAL_UNITS = _SEGMENTS - 4
"""Of k_B T in the bending energy: half of one for each of the 47 nodes that move, in two directions across, but for
two: how far the filament is buckled is given, and nothing holds it from turning about its axis."""
_PUBLISHED_COLUMNS = (
    "average_perp_distance",
    "calc_bending_energy",
    "peak_asymmetry",
    "non_coplanarity",
    "twist_angle",
)
_OF_FLUCTUATIONS = "fluctuations of theirs are smaller: see its energy"
_ON_ACTIN = """Do this first, [from a clone](../commands.md): `python studies reproduce compression --output DIR`,
a few minutes (`--quick`: one or two). DIR then holds

- `actin_compression_velocity=4.7.simularium` and so on: all filaments of a velocity, for the
  [Simularium viewer](https://simularium.allencell.org);
- `actin_compression_combined_metrics.csv`: all measures, in the columns of the table behind
  [their page](https://github.com/simularium/subcell-website);
- `ACTIN_COMPRESSION_VELOCITY/samples`: points along filaments, as
  [their pipeline](https://github.com/simularium/subcell-pipeline) reads them;
- `measurements/velocity-4.7` and so on: the run with its input, for `openmm-cylchain` and `analysis.load`.

**What is simulated.** What their template for Cytosim says: a filament of 500 nm begins straight, in a fluid of 10
mPa s at k_BT = 4.2 pN nm. Its bending rigidity is 0.041 pN µm². Springs of 10⁴ pN/nm hold both ends, and points 10
nm from them, on one line. Those of the first end move along it, until the ends are 350 nm apart. Ours is {segments}
straight segments of 10 nm, {replicates} replicates at the recommended step, at most 3.7 µs. (Beam elements as short
as the held 10 nm need steps of 12 ns.) Ours has the friction of a rod 7 nm thick, along it and across. Cytosim has
one friction for all directions, of its default thickness of 25 nm. ReaDDy has a particle for each monomer, and
rigidities and a viscosity of its own.

**What to expect.** The filament nearly follows Euler's elastica between clamped ends, because its slowest bend relaxes
in {relaxation:.0f} µs, and the fastest compression takes 1000 µs. At 150 µm/s it lags at first: it bends less far, and
farther from the middle. Its bending energy grows by the load of the elastica, at all velocities; chains of segments of
10 nm are 0.3 % softer. The elastica is that of a filament held over 5 nm at each end of ours, as far as the middle of
the first segment, and 6.7 nm of theirs.

**What differs, and why.** Ours has 46 k_BT on top of the elastica: half of k_BT for each way to bend, as in
equilibrium. Cytosim has two to three k_BT. Its implicit Euler steps of 0.5 µs, with segments of 1 nm, damp what relaxes
faster, here bends shorter than 180 nm, and would leave about five. So its filaments fluctuate less: their peaks are
nearer to the middle, and they are closer to a plane, by a fifth. Thermal bends of ours take up length, so that it
buckles by 1 to 2 % less far than the elastica.

**What ours does not have.** Its filaments have no twist, as those of Cytosim: they leave the plane to either side. In
ReaDDy they have a handed supertwist, a twist angle of about 70°, and ten times the non-coplanarity. Take a model of
monomers if you ask for that.

All numbers are means over the last three quarters of the compression. Those of Cytosim, under "paper", are means over
five replicates with standard errors, as points in the figure are. We have calculated them from
`data/actin_compression_combined_metrics.csv` of simularium/subcell-website (BSD-3-Clause, Copyright 2024, Allen
Institute for Cell Science). The bending energy is 198 times the mean there, by the rigidity over the distance of
their points."""


def configuration_of(velocity, replicates, refinement=1):
    """The configuration of a run, as text.

    Parameters
    ----------
    velocity : float
        In um/s, a key of ``_KEYS``.
    replicates : int
    refinement : int
        By how much the step is smaller than the recommended one.
    """
    duration = _DURATIONS[velocity]
    motion = f'velocity = ["{1e3 * _SHORTENING / duration:.9g} um/s", "0 um/s", "0 um/s"]\n'
    tethers = "".join(_TETHER.format(node=node) + (motion if node >= 0 else "") for node in (0, 1, -2, -1))
    values = {"velocity": velocity, "replicates": replicates, "tethers": tethers, "time_step": '"recommended"'}
    text = _CONFIGURATION.format(**values, duration=duration, interval=duration / _FRAMES)
    if refinement == 1:
        return text
    step = parse_configuration(text).simulation.time_step / refinement
    return text.replace('"recommended"', f'"{step:.9g} ps"')


def sampled(nodes):
    """Points (..., 200, 3) along filaments, on cubic splines through their nodes (..., nodes, 3).

    Theirs are on straight lines; a curve has directions and binormals everywhere.
    """
    numbers = np.linspace(0.0, 1.0, nodes.shape[-2])
    return CubicSpline(numbers, nodes, axis=-2)(np.linspace(0.0, 1.0, _POINTS))


def published():
    """Theirs: (points, means), for each simulator and velocity dicts by their columns.

    Points have arrays, at a few normalized times; means are over normalized times from a quarter on.
    """
    points, means = {}, {}
    with open(Path(__file__).with_name("published_compression.csv")) as file:
        for row in csv.DictReader(file):
            key = row.pop("simulator"), float(row.pop("velocity"))
            if row["normalized_time"] == _LATER:
                means[key] = {column: float(row[column]) for column in row if column != "normalized_time"}
            else:
                points.setdefault(key, []).append({column: float(value) for column, value in row.items()})
    return {
        key: {column: np.array([row[column] for row in rows]) for column in rows[0]} for key, rows in points.items()
    }, means


def _elastica(held, shortening):
    return HeldElastica(_LENGTH, held, _RIGIDITY, shortening)


def _run(records, name, text):
    """Measures (frames, replicates) of a run, which stays beside the records."""

    def compressed(configuration):
        folder = records.directory / name
        shutil.rmtree(folder, ignore_errors=True)
        run(parse_configuration(configuration), folder)
        finished = analysis.load(folder)
        nodes = np.array([finished.nodes(frame) for frame in range(len(finished))])
        points = sampled(nodes)
        measures = {column: measure(points) for column, measure in MEASURES.items()}
        return {"time": finished.times, "energy": compressed_shapes.bending_energy(nodes, _RIGIDITY), **measures}

    return records.measure(name, compressed, configuration=text)


def _samples(folder, replicate):
    """The text of a table of points of a replicate, in their format: times in s, positions in nm."""
    finished = analysis.load(folder)
    lines = ["fiber_point,time,xpos,ypos,zpos"]
    for frame in range(len(finished)):
        points = sampled(finished.nodes(frame)[replicate])
        time = f"{finished.times[frame] * 1e-12:.9g}"
        lines += [f"{number},{time},{x:.4f},{y:.4f},{z:.4f}" for number, (x, y, z) in enumerate(points)]
    return "\n".join(lines) + "\n"


def _metrics(runs):
    """The text of the table of all measures, with their columns."""
    lines = [",".join(("time", *MEASURES, "normalized_time", "seed", "key", "simulator", "repeat", "velocity"))]
    for velocity, data in runs.items():
        for repeat in range(data["energy"].shape[1]):
            for frame, time in enumerate(data["time"]):
                numbers = [time * 1e-12, *(data[column][frame, repeat] for column in MEASURES), time / data["time"][-1]]
                names = (str(repeat + 1), _KEYS[velocity], "openmm_cylchain", str(repeat), f"{velocity:g}")
                lines.append(",".join((*(f"{number:.8g}" for number in numbers), *names)))
    return "\n".join(lines) + "\n"


def _files(records, runs, names):
    files = {"actin_compression_combined_metrics.csv": lambda path: _write(path, _metrics(runs))}
    for velocity, name in names.items():
        folder = records.directory / name
        files[f"actin_compression_velocity={velocity:g}.simularium"] = lambda path, folder=folder: write_simularium(
            analysis.load(folder), path
        )
        for replicate in range(min(_SAVED, runs[velocity]["energy"].shape[1])):
            samples = f"{_SERIES}/samples/{_SERIES}_{_KEYS[velocity]}_{replicate + 1:06d}.csv"
            files[samples] = lambda path, folder=folder, replicate=replicate: _write(path, _samples(folder, replicate))
    return files


def _write(path, text):
    write_atomically(path, text.encode())


def _later_elastica(data):
    """Shortenings of these frames, and the elastica at them: of the distance of the ends, which are a step behind."""
    distances = data["contour_length"] * (1.0 - data["compression_ratio"])
    shortenings = _LENGTH - distances[_FIRST:].mean(axis=1)
    return shortenings, [_elastica(_HELD, own) for own in shortenings]


def _later(values):
    """The mean over replicates of means over these frames."""
    return simulation.mean(values[_FIRST:].mean(axis=0))


def _load(folder, data):
    """The slope of the bending energy over the shortening in pN: the engine's, with its error, and the elastica's."""
    finished = analysis.load(folder)
    energies = finished.energies["bending energy (pN nm)"] / len(finished.filaments)
    shortenings, exact = _later_elastica(data)
    line, covariance = np.polyfit(shortenings, energies[_FIRST:], 1, cov=True)
    theory = np.polyfit(shortenings, [own.energy for own in exact], 1)[0]
    return Estimate(float(line[0]), float(np.sqrt(covariance[0, 0]))), float(theory)


def _their_energy(own):
    """Their bending energy in pN nm and its standard error."""
    scale = _RIGIDITY * (_POINTS - 2) * (_POINTS - 1) / _LENGTH
    return scale * own["calc_bending_energy"], scale * own["calc_bending_energy_error"]


def _results(velocity, data, theirs, folder):
    at, thermal = f"at_{velocity:g}_um/s", _THERMAL_UNITS * thermal_energy(_TEMPERATURE) / PICONEWTON
    _, exact = _later_elastica(data)
    load, exact_load = _load(folder, data)
    cytosim = {name: Printed(theirs[name], theirs[f"{name}_error"]) for name in _PUBLISHED_COLUMNS}
    ours = {name: _later(data[name]) for name in (*_PUBLISHED_COLUMNS, "energy")}
    return [
        Result(f"load_{at}", "pN", load, Rule(3.0, 0.01, 0.02), exact_load),
        Result(
            f"bending_energy_less_{_THERMAL_UNITS}_k_BT_{at}",
            "pN nm",
            Estimate(ours["energy"].value - thermal, ours["energy"].error),
            Rule(3.0, 0.01, 0.02),
            float(np.mean([own.energy for own in exact])),
            Printed(*_their_energy(theirs)),
            "theirs has longer parts of its ends held, and two to three k_BT",
        ),
        Result(
            f"average_distance_from_the_axis_{at}",
            "nm",
            ours["average_perp_distance"],
            Rule(3.0, 0.02, 0.02),
            float(np.mean([own.average_distance(_POINTS) for own in exact])),
            cytosim["average_perp_distance"],
        ),
        *(
            Result(f"{name}_{at}", "1", ours[name], Rule(3.0), None, cytosim[name], _OF_FLUCTUATIONS)
            for name in ("peak_asymmetry", "non_coplanarity")
        ),
        Result(f"twist_angle_{at}", "degrees", ours["twist_angle"], Rule(3.0), 0.0, cytosim["twist_angle"]),
    ]


def _of_steps(velocity, data, fine):
    """The same in ten times smaller steps; each over the elastica at its own shortening, where that has one."""
    results = []
    for name, words, of_elastica, tolerance in (
        ("energy", "bending_energy", lambda own: own.energy, 0.003),
        ("average_perp_distance", "average_distance_from_the_axis", lambda own: own.average_distance(_POINTS), 0.003),
        ("peak_asymmetry", "peak_asymmetry", lambda own: 1.0, 0.05),
    ):
        ours = [_later(own[name]) for own in (data, fine)]
        exact = [np.mean([of_elastica(each) for each in _later_elastica(own)[1]]) for own in (data, fine)]
        ratio = float(ours[0].value / exact[0] / (ours[1].value / exact[1]))
        error = ratio * float(np.hypot(*(own.error / own.value for own in ours)))
        words = f"{words}_over_that_of_ten_times_smaller_steps_at_{velocity:g}_um/s"
        results.append(Result(words, "1", Estimate(ratio, error), Rule(3.0, tolerance), 1.0))
    return results


def _draw(figure, runs, theirs):
    figure.set_size_inches(8.0, 7.6)
    rows = {
        "average_perp_distance": "distance (nm)",
        "energy": "energy (pN nm)",
        "peak_asymmetry": "peak asymmetry",
        "non_coplanarity": "non-coplanarity",
    }
    axes = figure.subplots(len(rows), len(runs), sharex=True, sharey="row", squeeze=False)
    shortening = np.linspace(0.0, _SHORTENING, _FRAMES + 1)
    elastica = [_elastica(_HELD, own) for own in shortening]
    exact = {
        "average_perp_distance": [own.average_distance(_POINTS) for own in elastica],
        "energy": [own.energy for own in elastica],
    }
    thermal = _THERMAL_UNITS * thermal_energy(_TEMPERATURE) / PICONEWTON
    markers = {"cytosim": ("o", "#D55E00", "Cytosim"), "readdy": ("^", "#009E73", "ReaDDy")}
    for row, (name, label) in enumerate(rows.items()):
        for column, (velocity, data) in enumerate(runs.items()):
            axis = axes[row, column]
            own = simulation.mean(data[name])
            axis.plot(shortening, own.value, color=style.OURS, lw=1.0, label="ours")
            axis.fill_between(
                shortening, own.value - own.error, own.value + own.error, color=style.OURS, alpha=0.35, lw=0.0
            )
            if name in exact:
                axis.plot(shortening, exact[name], color=style.THEORY, lw=1.0, ls="--", label="elastica")
            if name == "energy":
                axis.plot(shortening[4:], np.array(exact[name])[4:] + thermal, color=style.THEORY, lw=1.0, ls=":")
            for simulator, (marker, colour, words) in markers.items():
                table = theirs[simulator, velocity]
                if name == "energy":
                    if simulator == "readdy":
                        continue
                    values, errors = _their_energy(table)
                else:
                    values, errors = table[name], table[f"{name}_error"]
                places = _SHORTENING * table["normalized_time"]
                axis.errorbar(places, values, errors, ls="", marker=marker, ms=4, color=colour, label=words)
            if row == 0:
                axis.set_title(f"{velocity:g} µm/s", fontsize=10)
            xlabel, ylabel = "shortening (nm)" if row == 3 else "", "" if column else label
            style.finish(axis, xlabel, ylabel, row == column == 0)
    axes[2, 0].set_ylim(0.0, 0.2)
    axes[3, 0].set_ylim(0.0, 0.024)


def _relaxation_time():
    """That of the slowest bend between clamped ends, zeta L^4/(4.730^4 EI) with the friction zeta per length, in us."""
    configuration = parse_configuration(configuration_of(150.0, 1))
    own, solvent = configuration.filaments[0].type, configuration.solvent
    friction = own.segment_friction(solvent.viscosity, solvent.temperature, _SEGMENTS).perpendicular
    length = _LENGTH - 2.0 * _HELD
    return friction * _SEGMENTS / _LENGTH * (length / 4.730) ** 4 / (_RIGIDITY * PICONEWTON) * 1e-6


def evaluate(records, quick):
    """Filaments compressed at the four velocities."""
    replicates = _REPLICATES[quick]
    points, means = published()
    names = {velocity: f"velocity-{velocity:g}" for velocity in _KEYS}
    runs = {own: _run(records, name, configuration_of(own, replicates)) for own, name in names.items()}
    results = [
        result
        for own, data in runs.items()
        for result in _results(own, data, means["cytosim", own], records.directory / names[own])
    ]
    for velocity in _FINE[quick]:
        fine = _run(records, f"{names[velocity]}-fine", configuration_of(velocity, replicates, 10))
        results += _of_steps(velocity, runs[velocity], fine)
    remarks = _ON_ACTIN.format(segments=_SEGMENTS, replicates=replicates, relaxation=_relaxation_time())
    title = (
        f"Compressed actin: ours with standard errors, the elastica (dotted: with {_THERMAL_UNITS} k_BT), and theirs"
    )
    pictures = {title: lambda figure: _draw(figure, runs, points)}
    return Outcome(results, pictures, remarks, _files(records, runs, names))


CASES = (Case("compression", "Filaments of 500 nm, compressed to 350 nm", (), evaluate),)
