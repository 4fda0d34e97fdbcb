"""The console script ``openmm-cylchain``: runs a configuration, explains its time step, informs.

Exit codes: 0 done, 1 the simulation blew up or a file could not be written, 2 wrong input, 3 a time step is
wrong, 130 and 143 interrupted by SIGINT and SIGTERM, 141 what read the output has ended.
"""

import argparse
import json
import math
import os
import select
import sys
import warnings
from dataclasses import replace
from pathlib import Path

from . import errors
from .cytosim import command as cytosim
from .errors import InputError, InstabilityError
from .export import command as export
from .rendering import command as rendering
from .runs.beginnings import START_NAMES
from .scans import command as scans
from .version import __version__

_FAILED, _WRONG_INPUT, _WRONG_STEP, _KEYBOARD_INTERRUPT, _OUTPUT_CLOSED = 1, 2, 3, 130, 141
_SECONDS_OF_CHECK = 20.0
_WARNINGS = tuple(one for one in vars(errors).values() if isinstance(one, type) and issubclass(one, UserWarning))


def main(arguments=None):
    """Run the console script, with arguments of the command line if none are given, and return its exit code."""
    return run_command(_parser(), arguments)


def run_command(parser, arguments=None):
    """Do what a parser sets as ``command``, tell its warnings and errors, and return the exit code."""
    options = parser.parse_args(arguments)
    with warnings.catch_warnings():
        for category in _WARNINGS:
            warnings.simplefilter("always", category)
        said, show = set(), warnings.showwarning

        def tell(message, category, *rest):
            if not issubclass(category, _WARNINGS):
                show(message, category, *rest)
            elif str(message) not in said:
                said.add(str(message))
                say("warning", message)

        warnings.showwarning = tell
        try:
            _refuse_empty(options)
            options.command(options)
            sys.stdout.flush()
        except InputError as error:
            say("error", error)
            return _WRONG_INPUT
        except InstabilityError as error:
            say("error", error)
            return _FAILED
        except OSError as error:
            if isinstance(error, BrokenPipeError) and _output_is_closed():
                if _resumable(options):
                    say("error", "what read the output has ended, and so has the run: continue it with --resume.")
                return _OUTPUT_CLOSED
            hint = (
                " A run that has been interrupted by this can be continued with --resume."
                if _resumable(options)
                else ""
            )
            if isinstance(error, FileNotFoundError) and _has_lost_its_directory(options):
                say("error", f"{options.output} has been removed while the run went on. Start it again ({error}).")
            else:
                say("error", f"{error}.{hint}")
            return _FAILED
        except KeyboardInterrupt:
            say("error", f"interrupted{'; a run can be continued with --resume' if _resumable(options) else ''}.")
            return _KEYBOARD_INTERRUPT
        except SystemExit as exit_request:
            return exit_request.code
    return 0


def _output_is_closed():
    # Whether nobody reads it any more, as after "head": a pipe to another program may break as well.
    if sys.stdout is not sys.__stdout__ or not hasattr(select, "poll"):
        return False
    poll = select.poll()
    poll.register(sys.stdout, 0)
    if not poll.poll(0):
        return False
    # Python writes what is left once more when it ends.
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
    return True


def _refuse_empty(options):
    for name, value in vars(options).items():
        if value == "":
            raise InputError(f"{name} is an empty text: give a name, or leave it out.")


def _has_lost_its_directory(options):
    return options.command is _run and options.output is not None and not os.path.isdir(options.output)


def _resumable(options):
    return options.command is _run and options.output is not None and os.path.isdir(options.output)


def say(kind, message):
    """Write a message of a kind, such as "error" or "warning", to standard error."""
    print(f"{kind}: {message}", file=sys.stderr, flush=True)


def _parser():
    parser = argparse.ArgumentParser(
        prog="openmm-cylchain", description="Brownian dynamics of filaments with OpenMM, from a configuration file."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="simulate a configuration and compare it with theory")
    run.add_argument("configuration", metavar="CONFIG", help="TOML file that describes filaments, solvent and run")
    run.add_argument("--output", metavar="DIR", help="directory for the files of the run; needed but for --dry-run")
    run.add_argument("--resume", action="store_true", help="continue the run in DIR from its last checkpoint")
    run.add_argument(
        "--dry-run", action="store_true", help="only say what would be built, how long it takes and how large it gets"
    )
    run.set_defaults(command=_run)
    _add_beginnings(commands)

    timestep = commands.add_parser("timestep", help="print the bounds on the time step and the recommended step")
    timestep.add_argument("configuration", metavar="CONFIG", help="TOML file that describes filaments and solvent")
    timestep.add_argument(
        "--check",
        action="store_true",
        help="run with the step of CONFIG and with a sixteenth of it, and say what is wrong; exit code 3 if something "
        "is, 0 if all is right or not resolved",
    )
    timestep.add_argument(
        "--seconds", type=float, metavar="N", help=f"how long the check may take, {_SECONDS_OF_CHECK:g} if not given"
    )
    timestep.add_argument("--json", metavar="FILE", help="write the results of the check to FILE as well")
    timestep.set_defaults(command=_time_step)

    scans.add_command(commands)
    rendering.add_command(commands)
    export.add_command(commands)
    cytosim.add_command(commands)
    information = commands.add_parser("info", help="print versions, engines and platforms, and why one is missing")
    information.set_defaults(command=_information)
    return parser


def _add_beginnings(commands):
    new = commands.add_parser("new", help="write a commented configuration to begin with")
    new.add_argument("kind", metavar="KIND", choices=START_NAMES, help=", ".join(START_NAMES))
    new.add_argument("file", metavar="FILE", nargs="?", help="KIND.toml if not given; never overwritten")
    new.set_defaults(command=_new)
    schema = commands.add_parser("schema", help="print the JSON schema of configurations, for editors")
    schema.add_argument("--scan", action="store_true", help="that of scans instead")
    schema.set_defaults(command=_schema)


def _run(options):
    from .runs.configuration import read_configuration
    from .runs.run import RunInterrupted
    from .runs.run_directory import RunDirectory
    from .runs.summarised_run import run_with_summary
    from .runs.summary_text import format_summary

    configuration = read_configuration(options.configuration)
    if options.dry_run:
        from .runs.dry_run import dry_run

        for line in dry_run(configuration):
            print(line, flush=True)
        return
    if options.output is None:
        raise InputError("Say where the files of the run go: --output DIR, or give --dry-run.")
    try:
        parts = run_with_summary(configuration, options.output, options.resume)
    except RunInterrupted as interruption:
        say("interrupted", interruption)
        raise SystemExit(128 + interruption.signal_number) from None
    directory = RunDirectory(options.output)
    print()
    print(format_summary(configuration, *parts))
    print(f"\nWritten to {directory.path}: {directory.summary.name}, {directory.figure.name}")


def _new(options):
    from .runs.beginnings import write_start

    path = write_start(options.kind, options.file)
    print(f"Written: {path}. Run it with\n    openmm-cylchain run {path} --output {path.stem}")


def _schema(options):
    from .runs.schema import configuration_schema, format_schema
    from .scans.schema import scan_schema

    print(format_schema(scan_schema() if options.scan else configuration_schema()))


_BOUND_LABELS = {
    "translation": "diffusion along the axis, eq. (54)",
    "rotation": "diffusion by rotation, eq. (55)",
    "diffusion": "diffusion of an end, eq. (56)",
    "stretching": "relaxation of a length, eq. (57)",
    "bending": "relaxation of a joint, eq. (58)",
}


def _time_step(options):
    from .filaments.straight_segments import STRAIGHT_SEGMENTS
    from .runs.configuration import read_configuration
    from .time_steps.recommended_step import recommended_time_step
    from .time_steps.stability import stability_bounds, time_step_bounds
    from .units.text import format_time

    if not options.check and (options.seconds is not None or options.json is not None):
        raise InputError("--seconds and --json belong to --check: give that, too.")
    configuration = read_configuration(options.configuration)
    solvent, settings = configuration.solvent, configuration.simulation
    for group in configuration.filaments:
        if group.is_reserve:
            continue
        arguments = (group.type, solvent.viscosity, solvent.temperature)
        kind, longest = group.type.segment_kind, None
        if group.growth is not None:
            longest = max(group.segments, round(group.growth.longest / group.type.segment_length))
        recommended = recommended_time_step(*arguments, settings.scheme, group.segments, longest=longest)
        print(f"{group.type.name}, {group.segments} {kind.name}s of {group.type.segment_length:g} nm")
        # Table 1 is of cylinders that are straight, and explicit schemes are for straight segments and beads.
        cylinders = kind is STRAIGHT_SEGMENTS
        for name, bound in (time_step_bounds(*arguments, segments=group.segments) if cylinders else {}).items():
            print(f"  {_BOUND_LABELS[name]:<36} {format_time(bound, 4):>12}")
        if kind.straight:
            stability = min(stability_bounds(*arguments, group.segments).values())
            print(f"  {'stability of explicit schemes':<36} {format_time(stability, 4):>12}")
        for name, allowed in recommended.allowed.items():
            time = format_time(allowed, 4) if math.isfinite(allowed) else "any"
            print(f"  {f'allowed by {name}':<36} {time:>12}")
        print(f"  {'recommended':<36} {format_time(recommended.step, 4):>12}  ({recommended.reason})")
        print(f"  {'in this configuration':<36} {format_time(settings.time_step, 4):>12}")
        step = replace(recommended, step=settings.time_step)
        print(f"  dynamics at that step: {step.describe_dynamics()}")
    _step_of_system(configuration)
    _steps_of_stages(configuration)
    if options.check:
        _check_time_step(configuration, options)


def _steps_of_stages(configuration):
    # Of those that are no pieces, and of other configurations than those before.
    from .runs.initial_state import recommended_step
    from .units.text import format_time

    told = set()
    for stage in configuration.stages:
        own, settings = stage.configuration, stage.configuration.simulation
        if not stage.is_piece and id(own) not in told:
            told.add(id(own))
            recommended = recommended_step(own, settings.scheme, settings.engine, settings.seed)
            steps = f"recommended {format_time(recommended.step, 4)}, here {format_time(settings.time_step, 4)}"
            print(f"stage {stage.name!r}: {steps}")


def _step_of_system(configuration):
    from .runs.configuration import named_bound
    from .runs.initial_state import recommended_step, stands_alone
    from .units.text import format_time

    if stands_alone(configuration):
        return
    settings = configuration.simulation
    recommended = recommended_step(configuration, settings.scheme, settings.engine, settings.seed)
    print("with all that acts on them")
    for name, allowed in recommended.allowed.items():
        if math.isfinite(allowed):
            print(f"  {format_time(allowed, 4):>12}  allowed by {named_bound(configuration, name)}")
    reason = named_bound(configuration, recommended.reason)
    print(f"  {'recommended':<36} {format_time(recommended.step, 4):>12}  ({reason})")
    print(f"  {'in this configuration':<36} {format_time(settings.time_step, 4):>12}")


def _check_time_step(configuration, options):
    from .output.files import check_output_path, write_atomically
    from .output.progress import ProgressMessages
    from .runs.run import RunInterrupted, check_step

    if options.json is not None:
        check_output_path(options.json)
    # What is printed already is for the time until the check is done.
    sys.stdout.flush()
    progress = ProgressMessages()
    try:
        check = check_step(configuration, _SECONDS_OF_CHECK if options.seconds is None else options.seconds, progress)
    except RunInterrupted as interruption:
        progress.finish()
        say("interrupted", interruption)
        raise SystemExit(128 + interruption.signal_number) from None
    progress.finish()
    print(f"\n{check}", flush=True)
    if options.json is not None:
        content = json.dumps(check.as_dict(), indent=2, allow_nan=False)
        write_atomically(Path(options.json), f"{content}\n".encode())
        print(f"\nWritten to {options.json}")
    if check.verdict == "wrong":
        raise SystemExit(_WRONG_STEP)
    if check.verdict != "right":
        say("warning", "the step is not known to be right: give the check more time with --seconds.")


def _information(options):
    from .runs.information import format_information

    print(format_information())


if __name__ == "__main__":
    sys.exit(main())
