"""The figure of a run: networks in their box, what is named once, colours of linkers, legends that cover nothing."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from openmm_cylchain import analysis
from openmm_cylchain.output.colors import spring_colors
from openmm_cylchain.rendering.colors import filament_colors, linker_colors
from support.small_runs import NETWORK, TWO_LOADS, simulated

pytestmark = pytest.mark.usefixtures("rendered_figures_of_runs")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory, rendered_figures_of_runs):
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


def test_a_network_is_shown_at_its_start_and_at_its_end(drawn):
    axes, run = drawn
    assert [axis.get_title().split(",")[0] for axis in axes[:2]] == ["Filaments at the start", "Filaments at 1 ms"]
    # Those that there are in the last frame.
    drawn_there = [len(run.springs(-1, kind)[0]) > 0 for kind in range(2)]
    springs = [f"{name}, both hands bound" for name, there in zip(run.spring_names, drawn_there) if there]
    assert "motor, both hands bound" in springs
    assert labels_of(axes[0]) == ["20 × ACT, 3 to 4 segments", "last node (plus end)"]
    assert labels_of(axes[1]) == [*labels_of(axes[0]), *springs]
    shares = ["nematic order of filaments", "share of filaments in bundles", "largest joined network"]
    assert [label.removeprefix("share of filaments in the ") for label in labels_of(axes[2])] == shares
    order, _, joined = (line.get_ydata() for line in axes[2].lines)
    assert len(order) == len(run) and 0.0 <= joined.min() and joined.max() <= 1.0


def test_legends_do_not_hide_scale_bars(drawn):
    axes, _ = drawn
    for axis in axes[:2]:
        (length,) = axis.texts
        bar = axis.lines[-1]
        for own in (length, bar):
            assert not axis.get_legend().get_window_extent().overlaps(own.get_window_extent())


def test_filaments_and_linkers_are_within_the_box(drawn):
    """What leaves it goes on at the opposite face, and so do linkers: they lie on filaments."""
    axes, run = drawn
    edges = np.diag(run.box)[:2]
    axis = axes[1]
    np.testing.assert_allclose((axis.get_xlim(), axis.get_ylim()), np.stack([np.zeros(2), edges], axis=1), atol=1e-9)
    short, long, *springs = (np.array(lines.get_segments()) for lines in axis.collections)
    nodes = np.concatenate([own[:-1, :2] for own in run.nodes(-1)]) % edges
    shown = np.concatenate([short, long])[:, 0]
    for node in nodes:
        assert np.min(np.linalg.norm(shown - node, axis=1)) < 1e-2
    (ends,) = [line.get_xydata() for line in axis.lines if line.get_label() == "last node (plus end)"]
    np.testing.assert_allclose(ends, [own[-1, :2] % edges for own in run.nodes(-1)], atol=1e-2)
    for kind, own in enumerate(springs):
        lines, _ = run.springs(-1, kind)
        for place in lines[:, 0, :2] % edges:
            assert np.min(np.linalg.norm(own[:, 0] - place, axis=1)) < 1e-2


def test_free_filaments_are_compared_with_theory(tmp_path, monkeypatch):
    """What holds for several kinds is named once."""
    figures, savefig = [], Figure.savefig
    monkeypatch.setattr(
        Figure, "savefig", lambda own, *rest, **options: (figures.append(own), savefig(own, *rest, **options))
    )
    text = NETWORK[: NETWORK.index("[[linkers]]")].replace("segments = 4", "segments = [3, 4]")
    simulated(tmp_path, text + NETWORK[NETWORK.index("[simulation]") :])
    axes = figures[0].axes
    kinds = ["10 × ACT, 3 segments", "10 × ACT, 4 segments"]
    (persistence,) = [label for label in labels_of(axes[2]) if label not in kinds]
    assert persistence.startswith("exp(-s/lp), lp = 17.8")
    assert sorted(labels_of(axes[3])) == [*kinds, "exact"]


def test_legends_of_linkers_are_below_the_curves(drawn):
    axes, _ = drawn
    for axis in (axes[1], axes[2], axes[4], axes[5]):
        frame, legend = axis.get_window_extent(), axis.get_legend().get_window_extent()
        assert legend.y1 <= frame.y0


def test_colours_are_those_of_pictures(drawn):
    axes, run = drawn
    assert to_hex(axes[0].collections[0].get_color()[0]).upper() == filament_colors(run)["ACT"]
    for kind, name in enumerate(run.spring_names):
        colours = {
            to_hex(line.get_color()).upper()
            for axis in (axes[1], axes[4], axes[5])
            for line in axis.lines
            if str(line.get_label()).startswith(f"{name}, ")
        }
        assert colours == {linker_colors(run)[kind]}


def test_motors_have_one_color_and_crosslinkers_another(drawn):
    """In whatever order; they differ in lightness, too."""
    assert spring_colors([False, True]) == spring_colors([True, False])[::-1]
    motor, crosslinker = (rgb_to_luminance(name) for name in spring_colors([True, False]))
    assert crosslinker > 3.0 * motor
    assert len(set(spring_colors([True, False, True, False]))) == 4


def rgb_to_luminance(name):
    channels = np.array(to_rgb(name))
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


@pytest.mark.parametrize(
    "text, labels",
    [
        (TWO_LOADS, ["2 × DNA, 5 segments, 0.2 pN", "1 × DNA, 5 segments, 10 pN"]),
        # Not all filaments of a table.
        (
            TWO_LOADS.replace("table = 1", "filament = 1").replace("table = 2", "filament = 2"),
            ["1 × DNA, 5 segments, no pull", "1 × DNA, 5 segments, 0.2 pN", "1 × DNA, 5 segments, 10 pN"],
        ),
    ],
    ids=["tables", "filaments"],
)
def test_loads_are_named(text, labels, tmp_path, monkeypatch):
    figures, savefig = [], Figure.savefig
    monkeypatch.setattr(
        Figure, "savefig", lambda own, *rest, **options: (figures.append(own), savefig(own, *rest, **options))
    )
    run = analysis.load(simulated(tmp_path, text))
    panel = figures[0].axes[0]
    assert labels_of(panel) == labels
    colours = {to_hex(line.get_color()).upper() for line in panel.lines if line.get_label() in labels}
    assert colours == set(filament_colors(run).values())
