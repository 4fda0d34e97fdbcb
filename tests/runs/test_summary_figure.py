"""The figure of a run: what is named once, colours of linkers, and legends that cover nothing."""

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from openmm_cylchain import analysis
from openmm_cylchain.rendering.colors import filament_colors, linker_colors
from support.small_runs import NETWORK, simulated


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """The axes of the figure of a network of filaments of two lengths, and its run."""
    figures, savefig = [], Figure.savefig

    def noted(figure, *arguments, **options):
        figures.append(figure)
        return savefig(figure, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", noted)
        path = simulated(tmp_path_factory.mktemp("run"), NETWORK.replace("segments = 4", "segments = [3, 4]"))
    (figure,) = figures
    FigureCanvasAgg(figure).draw()
    return figure.axes, analysis.load(path)


def labels_of(axis):
    return axis.get_legend_handles_labels()[1]


def test_what_holds_for_several_kinds_is_named_once(drawn):
    axes, run = drawn
    kinds = ["10 × ACT, 3 segments", "10 × ACT, 4 segments"]
    # Of those that there are in the last frame.
    drawn_there = [len(run.springs(-1, kind)[0]) > 0 for kind in range(2)]
    springs = [f"{name}, both hands bound" for name, there in zip(run.spring_names, drawn_there) if there]
    assert "motor, both hands bound" in springs
    assert labels_of(axes[0]) == [*kinds, *springs]
    (persistence,) = [label for label in labels_of(axes[2]) if label not in kinds]
    assert persistence.startswith("exp(-s/lp), lp = 17.8")
    assert sorted(labels_of(axes[3])) == [*kinds, "exact for free chains in equilibrium"]


def test_legends_of_linkers_are_below_the_curves(drawn):
    axes, _ = drawn
    for axis in (axes[0], axes[4], axes[5]):
        frame, legend = axis.get_window_extent(), axis.get_legend().get_window_extent()
        assert legend.y1 <= frame.y0


def test_colours_are_those_of_pictures(drawn):
    axes, run = drawn
    assert to_hex(axes[0].lines[0].get_color()).upper() == filament_colors(run)["ACT"]
    for kind, name in enumerate(run.spring_names):
        colours = {
            to_hex(line.get_color()).upper()
            for axis in (axes[0], axes[4], axes[5])
            for line in axis.lines
            if str(line.get_label()).startswith(f"{name}, ")
        }
        assert colours == {linker_colors(run)[kind]}
