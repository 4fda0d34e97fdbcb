"""The command ``openmm-cylchain scan``."""

import contextlib

from ..errors import InputError

_EXECUTORS = ("processes", "dask", "mpi")


def add_command(commands):
    """Add ``scan`` to the subcommands of an argparse parser."""
    parser = commands.add_parser("scan", help="do replicas and parameter grids of a run, and gather their results")
    parser.add_argument("scan", metavar="SCAN", help="TOML file that names a run, the keys that vary and replicas")
    parser.add_argument("--output", metavar="DIR", help="directory of all runs, tables and the figure")
    parser.add_argument(
        "--workers", type=int, metavar="N", help="runs at a time here; one for each processor if not given"
    )
    parser.add_argument(
        "--executor",
        choices=_EXECUTORS,
        default="processes",
        help="where runs are started: here, on workers of Dask, or on ranks of MPI; processes if not given",
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, such as tcp://node:8786")
    parser.add_argument("--dry-run", action="store_true", help="only list the runs")
    parser.set_defaults(command=_scan)


def _scan(options):
    from .scan_file import read_scan
    from .scan_runs import scan

    if (options.scheduler is not None) != (options.executor == "dask"):
        raise InputError("--executor dask and --scheduler ADDRESS belong together: give both or neither.")
    if options.workers is not None and options.executor != "processes":
        raise InputError(f"--workers is for processes here: --executor {options.executor} has workers of its own.")
    own = read_scan(options.scan)
    if options.dry_run:
        for run in own.runs:
            print(f"{run.name}  {run.label}, seed {run.seed}")
        print(f"{len(own.runs)} run{'s' * (len(own.runs) > 1)}")
        return
    if options.output is None:
        raise InputError("Say where the runs go: --output DIR, or give --dry-run.")
    with contextlib.ExitStack() as stack:
        executor = _executor(options, stack)
        result = scan(own, options.output, executor, options.workers, lambda line: print(line, flush=True))
    if not result.is_complete:
        counts = ", ".join(
            f"{sum(run['status'] == status for run in result.runs)} {status}" for status in ("failed", "interrupted")
        )
        print(f"Not complete: {counts}. What they said is in log.txt of their directories; the same command goes on.")
        raise SystemExit(1)


def _executor(options, stack):
    if options.executor == "dask":
        try:
            from distributed import Client
        except ImportError:
            raise InputError("--executor dask needs Dask: pip install distributed.") from None
        try:
            client = stack.enter_context(Client(options.scheduler, timeout=20))
        except (OSError, ValueError) as error:
            raise InputError(f"--scheduler {options.scheduler} cannot be reached: {error}.") from None
        return client.get_executor(pure=False)
    if options.executor == "mpi":
        try:
            from mpi4py.futures import MPIPoolExecutor
        except ImportError:
            raise InputError("--executor mpi needs mpi4py and MPI: pip install mpi4py.") from None
        return stack.enter_context(MPIPoolExecutor())
    return None
