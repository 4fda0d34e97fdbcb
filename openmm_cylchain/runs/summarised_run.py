"""A run with its summary and figure: what the command ``run`` does, and each run of a scan."""

from .growth_summary import summarise_growth, summarise_population
from .linker_summary import summarise_linkers
from .measures import course, load_run, measure
from .run import run
from .run_directory import RunDirectory
from .stage_summary import as_summarised, frames_of_last_stage, summarise_stages
from .summary import group_members, load_trajectory, summarise
from .summary_figure import write_figure
from .summary_text import write_summary


def run_with_summary(configuration, output, resume=False):
    """Run a configuration to its end, and write its summary and figure; see ``run`` for arguments and errors.

    Returns lists of GroupSummary, LinkerSummary, Measure and EndSummary, a PopulationSummary or None, and a list of
    StageSummary. Of a run of several stages, what is compared with theory is of the last one.
    """
    run(configuration, output, resume)
    configuration = as_summarised(configuration)
    directory = RunDirectory(output)
    trajectory = load_trajectory(configuration, directory)
    groups = summarise(configuration, trajectory.slice(frames_of_last_stage(configuration), copy=False))
    linkers = summarise_linkers(configuration, directory)
    own = load_run(directory)
    measures = measure(configuration, own)
    members = group_members(configuration)
    growth = summarise_growth(configuration, members, directory)
    population = summarise_population(configuration, members, directory)
    stages = summarise_stages(configuration, directory)
    # The summary comes last: a run that has one is complete.
    write_figure(configuration, directory, trajectory, course(configuration, own))
    write_summary(configuration, directory, groups, linkers, measures, growth, population, stages)
    return groups, linkers, measures, growth, population, stages
