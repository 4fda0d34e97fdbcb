"""Figures of runs, of which tests render those that they look at: that takes longer than their runs."""

import io
from contextlib import contextmanager

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

_FIGURE = "openmm_cylchain.runs.summary_figure.Figure"


def _blank_picture():
    content = io.BytesIO()
    FigureCanvasAgg(Figure(figsize=(1, 1))).print_png(content)
    return content.getvalue()


@contextmanager
def blank():
    """Figures of runs get all that they show, but files have nothing on them."""
    picture = _blank_picture()

    class BlankFigure(Figure):
        def savefig(self, file, **options):
            file.write(picture)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_FIGURE, BlankFigure)
        yield


@contextmanager
def rendered():
    """Figures of runs are as users get them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_FIGURE, Figure)
        yield
