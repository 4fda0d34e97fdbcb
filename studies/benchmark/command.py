"""The command ``benchmark``."""

from openmm_cylchain.engine_choice import ENGINES
from openmm_cylchain.output.files import check_output_path
from openmm_cylchain.output.progress import ProgressMessages


def add_command(commands):
    """Add ``benchmark`` to the subcommands of an argparse parser."""
    parser = commands.add_parser("benchmark", help="measure speed and memory on this machine")
    benchmarks = parser.add_subparsers(required=True, metavar="BENCHMARK")
    engines = benchmarks.add_parser(
        "engines", help="speed of the engines and of stock OpenMM: 200 chains of 64 segments, one to two minutes"
    )
    engines.set_defaults(command=_benchmark_engines)
    scaling = benchmarks.add_parser(
        "scaling", help="cost and memory per segment: 10^2 to 10^6 segments, several minutes and 3 GB of memory"
    )
    scaling.add_argument("--engine", choices=ENGINES, help="default: the fastest that is available")
    scaling.set_defaults(command=_benchmark_scaling)
    time_step = benchmarks.add_parser(
        "time-step", help="errors and speed against the step, for every scheme and several systems, about ten minutes"
    )
    time_step.add_argument("--plot", metavar="FILE", help="draw the errors to FILE, a .png, .svg or .pdf")
    time_step.set_defaults(command=_benchmark_time_step)
    bead_spring = benchmarks.add_parser(
        "bead-spring", help="segments of 10 to 1200 nm beside touching beads of stock OpenMM, several minutes"
    )
    bead_spring.set_defaults(command=_benchmark_bead_spring)
    base_pairs = benchmarks.add_parser(
        "base-pairs",
        help="DNA base pair by base pair: the normal modes of Panja et al. beside scheme implicit, minutes",
    )
    base_pairs.set_defaults(command=_benchmark_base_pairs)
    networks = benchmarks.add_parser(
        "networks", help="links and contacts in implicit steps beside explicit ones: 200 filaments, ten minutes"
    )
    networks.set_defaults(command=_benchmark_networks)
    kinetics = benchmarks.add_parser(
        "kinetics", help="motors and crosslinkers: a contractile bundle at several steps, most of an hour"
    )
    kinetics.set_defaults(command=_benchmark_kinetics)
    turnover = benchmarks.add_parser(
        "turnover", help="filaments that grow, begin, vanish and are cut, with linkers: 10 000 segments, some minutes"
    )
    turnover.set_defaults(command=_benchmark_turnover)
    spindle = benchmarks.add_parser(
        "spindle", help="200 microtubules that turn over in a plane, 6000 kinesin-5 and 3000 dynein, some minutes"
    )
    spindle.set_defaults(command=_benchmark_spindle)
    dna = benchmarks.add_parser(
        "dna", help="a supercoiled plasmid, and 100 000 segments with extruders beside polychrom's way, many minutes"
    )
    dna.set_defaults(command=_benchmark_dna)
    platforms = benchmarks.add_parser(
        "platforms", help="filaments, alone and among particles, on each platform and in each precision, many minutes"
    )
    platforms.set_defaults(command=_benchmark_platforms)
    of_networks = (networks, kinetics, turnover, spindle, dna, platforms)
    for benchmark in (engines, scaling, time_step, bead_spring, base_pairs, *of_networks):
        benchmark.add_argument("--quick", action="store_true", help="a rough measurement within a minute")
        benchmark.add_argument("--json", metavar="FILE", help="write machine, settings and results to FILE as well")


def _benchmark_engines(options):
    from .engines import FULL, QUICK, benchmark_engines

    _benchmark(options, lambda say: benchmark_engines(QUICK if options.quick else FULL, say=say))


def _benchmark_scaling(options):
    from .scaling import FULL, QUICK, benchmark_scaling

    _benchmark(options, lambda say: benchmark_scaling(options.engine, QUICK if options.quick else FULL, say))


def _benchmark_time_step(options):
    from .time_step import FULL, QUICK, benchmark_time_step
    from .time_step_figure import check_figure_path, write_figure

    if options.plot is not None:
        check_figure_path(options.plot)
    results = []

    def measure(say):
        report, measured = benchmark_time_step(QUICK if options.quick else FULL, say)
        results.extend(measured)
        return report

    _benchmark(options, measure)
    if options.plot is not None:
        write_figure(results, options.plot)
        print(f"Drawn to {options.plot}")


def _benchmark_bead_spring(options):
    from .bead_spring import FULL, QUICK, benchmark_bead_spring

    _benchmark(options, lambda say: benchmark_bead_spring(QUICK if options.quick else FULL, say))


def _benchmark_base_pairs(options):
    from .base_pairs import FULL, QUICK, benchmark_base_pairs

    _benchmark(options, lambda say: benchmark_base_pairs(QUICK if options.quick else FULL, say))


def _benchmark_networks(options):
    from .networks import FULL, QUICK, benchmark_networks

    _benchmark(options, lambda say: benchmark_networks(QUICK if options.quick else FULL, say))


def _benchmark_kinetics(options):
    from .kinetics import FULL, QUICK, benchmark_kinetics

    _benchmark(options, lambda say: benchmark_kinetics(QUICK if options.quick else FULL, say=say))


def _benchmark_turnover(options):
    from .turnover import FULL, QUICK, benchmark_turnover

    _benchmark(options, lambda say: benchmark_turnover(QUICK if options.quick else FULL, say=say))


def _benchmark_spindle(options):
    from .spindle import FULL, QUICK, benchmark_spindle

    _benchmark(options, lambda say: benchmark_spindle(QUICK if options.quick else FULL, say))


def _benchmark_dna(options):
    from .dna import FULL, QUICK, benchmark_dna

    _benchmark(options, lambda say: benchmark_dna(QUICK if options.quick else FULL, say))


def _benchmark_platforms(options):
    from .platforms import FULL, QUICK, benchmark_platforms

    _benchmark(options, lambda say: benchmark_platforms(QUICK if options.quick else FULL, say))


def _benchmark(options, measure):
    from .report import format_report, write_json

    if options.json is not None:
        check_output_path(options.json)
    progress = ProgressMessages()
    try:
        report = measure(progress)
    finally:
        progress.finish()
    print(format_report(report))
    if options.json is not None:
        write_json(report, options.json)
        print(f"\nWritten to {options.json}")
