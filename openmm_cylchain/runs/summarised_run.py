"""A run with its summary and figure: what the command ``run`` does, and each run of a scan."""

from .growth_summary import summarise_growth, summarise_population
from .linker_summary import summarise_linkers
from .measures import course, load_run, measure
from .run import run
from .run_directory import RunDirectory
from .summary import group_members, load_trajectory, summarise
from .summary_figure import write_figure
from .summary_text import write_summary


def run_with_summary(configuration, output, resume=False):
    """Run a configuration to its end, and write its summary and figure; see ``run`` for arguments and errors.

    Returns lists of GroupSummary, LinkerSummary, Measure and EndSummary, and a PopulationSummary or None.
    """
    run(configuration, output, resume)
    directory = RunDirectory(output)
    trajectory = load_trajectory(configuration, directory)
    groups = summarise(configuration, trajectory)
    linkers = summarise_linkers(configuration, directory)
    own = load_run(directory)
    measures = measure(configuration, own)
    members = group_members(configuration)
    growth = summarise_growth(configuration, members, directory)
    population = summarise_population(configuration, members, directory)
    # The summary comes last: a run that has one is complete.
    write_figure(configuration, directory, trajectory, course(configuration, own))
    write_summary(configuration, directory, groups, linkers, measures, growth, population)
    return groups, linkers, measures, growth, population
