"""The command ``openmm-cylchain export``."""

from ..errors import InputError

FORMATS = ("simularium", "ovito", "vmd")


def add_command(commands):
    """Add ``export`` to the subcommands of an argparse parser."""
    parser = commands.add_parser("export", help="write a run for Simularium, OVITO or VMD")
    parser.add_argument("run", metavar="RUN", help="directory of a run")
    parser.add_argument("--format", required=True, metavar="FORMAT", help="simularium, ovito or vmd")
    parser.add_argument("--output", metavar="FILE", required=True, help=".simularium, .gsd for OVITO, .tcl for VMD")
    parser.add_argument("--incomplete", action="store_true", help="write a run that is not at its end")
    parser.set_defaults(command=_export)


def _export(options):
    if options.format not in FORMATS:
        raise InputError(f"--format must be one of {', '.join(FORMATS)}, but is {options.format!r}.")
    from ..analysis.run_loading import load
    from .ovito import write_ovito
    from .simularium import write_simularium
    from .vmd import write_vmd

    writer = {"simularium": write_simularium, "ovito": write_ovito, "vmd": write_vmd}[options.format]
    writer(load(options.run, options.incomplete), options.output)
    print(f"Written to {options.output}")
