"""Loading of the directory of a run, as far as its frames are whole."""

import math
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..filaments.twist import has_twist
from ..output.dcd_frames import DCDFrames
from ..output.files import as_path
from ..output.read_tables import read_reports, read_table
from ..output.record_file import read_records
from ..output.run_description import read_run_description
from ..output.run_files import RunFiles
from ..units.quantities import true_or_false
from .runs import Run


def load(path: str | Path, incomplete: bool = False) -> Run:
    """Load the directory that ``openmm-cylchain run`` or a ``RunReporter`` has written.

    Parameters
    ----------
    path : str or Path
    incomplete : bool
        Take a run that goes on still, was interrupted or has blown up, as far as its frames are whole.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If the directory holds no run, or one that is not at its end (unless ``incomplete``), or a damaged one.

    Warns
    -----
    PrecisionWarning
        If positions are so far from the origin that their single precision is coarser than thermal fluctuations.

    Examples
    --------
    >>> run = load("output_f_actin")  # doctest: +SKIP
    >>> run.mdtraj(slice(100, None))  # doctest: +SKIP
    """
    files, incomplete = RunFiles(as_path(path, "path")), true_or_false(incomplete, "incomplete")
    if not files.path.is_dir():
        raise InputError(f"{path} is not a directory: give that of `openmm-cylchain run --output` or of a RunReporter.")
    if not files.description.exists():
        reason = "its files are those of an older version" if files.trajectory.exists() else "nothing has run into it"
        raise InputError(f"{path} is not the directory of a run: it has no {files.description.name}, {reason}.")
    if not incomplete and files.is_being_written:
        raise InputError(
            f"The run in {path} is still going on: wait until it ends, or take what there is with incomplete=True "
            "(--incomplete)."
        )
    description = read_run_description(files.description)
    needed = [files.topology, files.trajectory, files.energies]
    needed += [files.linkers, files.linker_places] if description.linkers else []
    needed += [files.twists] if any(has_twist(own.type) for own in description.filaments) else []
    for file in needed:
        if not file.exists():
            raise InputError(f"{path} lacks {file.name}: the run has not begun, or its files were moved.")
    frames, energies = _whole_frames(files, description)
    expected = math.inf if description.frames is None else description.frames
    if frames == 0:
        raise InputError(f"The run in {path} has not a frame that is whole.")
    if frames < expected < math.inf and not incomplete:
        raise InputError(
            f"The run in {path} is incomplete: it has {frames} of {expected} frames. Continue it with "
            f"`openmm-cylchain run {files.configuration} --output {path} --resume`, or take what there is with "
            "incomplete=True (--incomplete)."
        )
    run = Run(files, description, int(min(frames, expected)), energies)
    run.warn_of_rounding()
    return run


def _whole_frames(files, description):
    # A kill may come between the writing of one file and of the next.
    energies = read_table(files.energies)
    dcd = DCDFrames(files.trajectory)
    if dcd.particles != description.particles:
        raise InputError(
            f"{files.trajectory} has {dcd.particles} particles, but {files.description.name} {description.particles}: "
            "they are not of one run."
        )
    frames = min(len(energies["step"]), len(dcd))
    if description.stages:
        expected = np.array([0, *(step for own in description.stages for step in own.steps)])[:frames]
        frames = len(expected)
    else:
        expected = np.arange(frames) * description.steps_per_frame
    if description.steps is None and frames:
        # A RunReporter may come into a Simulation that has gone on for a while.
        expected += int(energies["step"][0])
    if not np.array_equal(energies["step"][:frames], expected):
        raise InputError(f"{files.energies} does not have a line for each frame of the run.")
    if description.linkers:
        table = read_reports(files.linkers, len(description.linkers))
        frames = min(frames, len(table["step"]))
        recorded = read_records(files.linker_places)["step"]
        held = (table["one hand bound"] + table["both hands bound"])[max(frames - 1, 0) : frames].sum()
        unfinished = held > 0 and (len(recorded) == 0 or recorded[-1] < expected[frames - 1])
        if unfinished and (description.frames is None or frames < description.frames):
            frames -= 1
    for path in (files.pulling, files.twist, files.growth, files.wall_forces, files.contact_forces):
        if path.exists():
            frames = min(frames, len(read_reports(path)["step"]))
    if files.twists.exists():
        frames = min(frames, len(read_records(files.twists)))
    return frames, energies
