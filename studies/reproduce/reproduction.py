"""Runs the cases of a paper: measurements, pictures, results.json and the page, in one directory."""

import io
import json
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from openmm_cylchain.errors import InputError
from openmm_cylchain.output.files import write_atomically
from openmm_cylchain.version import __version__

from . import actin_compression, beam_accuracy, chandran2009, growth_under_load, panja2015, pesek2016, style
from .page import format_page
from .records import Records

PAPERS = {
    "pesek2016": pesek2016,
    "diffusion": chandran2009,
    "panja2015": panja2015,
    "beams": beam_accuracy,
    "compression": actin_compression,
    "ratchets": growth_under_load,
}
_RESULTS, _MEASUREMENTS = "results.json", "measurements"


def reproduce(paper, output, figure=None, quick=False, force=False, say=lambda message: None):
    """Reproduce a paper, or one figure of it.

    Measurements are kept in the directory and not made again unless ``force`` is set or their settings are others. The
    results, pictures and the page are written after each case, so that a run that is killed goes on where it was.

    Parameters
    ----------
    paper : str
        A key of ``PAPERS``.
    output : str or Path
        Directory; created if it does not exist.
    figure : int, optional
        One figure; everything if not given.
    quick : bool
        Reduced statistics.
    force : bool
        Measure anew.
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    dict
        The content of results.json: with what is there of other figures.

    Raises
    ------
    InputError
        For a paper or a figure that is not reproduced, or an output that is no directory.
    """
    cases = _chosen(paper, figure)
    directory = Path(output)
    if directory.exists() and not directory.is_dir():
        raise InputError(f"{directory} is not a directory.")
    directory.mkdir(parents=True, exist_ok=True)
    content = _content(paper, directory)
    for number, case in enumerate(cases, 1):
        say(f"{number} of {len(cases)}: {case.title}")
        records = Records(directory / _MEASUREMENTS, force, lambda name: say(f"  measuring {name}"))
        evaluated = _evaluated(case, records, quick, directory)
        # Another process may have written other figures in the meantime.
        content = _content(paper, directory)
        content["cases"] = _in_order(paper, content["cases"], evaluated)
        write_atomically(directory / _RESULTS, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())
        write_atomically(directory / f"{paper}.md", format_page(content).encode())
    return content


def _chosen(paper, figure):
    if paper not in PAPERS:
        raise InputError(f"There is no paper {paper!r}; known are {', '.join(PAPERS)}.")
    cases = PAPERS[paper].CASES
    if figure is None:
        return cases
    chosen = [case for case in cases if figure in case.figures]
    if not chosen:
        known = sorted({number for case in cases for number in case.figures})
        raise InputError(f"Figure {figure} of {paper} is not reproduced; those that are: {', '.join(map(str, known))}.")
    return chosen


def _content(paper, directory):
    head = {"title": PAPERS[paper].TITLE, "citation": PAPERS[paper].CITATION, "version": __version__}
    path = directory / _RESULTS
    cases = []
    if path.exists():
        try:
            found = json.loads(path.read_text())
            cases = found["cases"] if found["title"] == head["title"] else None
        except (json.JSONDecodeError, KeyError, TypeError):
            cases = None
        if cases is None:
            raise InputError(f"{path} is not of this paper: choose another directory.")
    return {**head, "cases": cases}


def _evaluated(case, records, quick, directory):
    outcome = case.evaluate(records, quick)
    pictures = {}
    for number, (title, draw) in enumerate(outcome.pictures.items()):
        name = f"{case.key}{chr(ord('a') + number) if len(outcome.pictures) > 1 else ''}.png"
        _write_picture(draw, directory / name)
        pictures[title] = name
    for name, write in outcome.files.items():
        (directory / name).parent.mkdir(parents=True, exist_ok=True)
        write(directory / name)
    return {
        "key": case.key,
        "title": case.title,
        "quick": quick,
        "seconds": records.seconds,
        "remarks": outcome.remarks,
        "pictures": pictures,
        "results": [result.as_dict() for result in outcome.results],
    }


def _write_picture(draw, path):
    figure = Figure(figsize=style.SIZE, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure)
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=style.DOTS_PER_INCH)
    write_atomically(path, image.getvalue())


def _in_order(paper, cases, new):
    every = {case["key"]: case for case in (*cases, new)}
    order = [case.key for case in PAPERS[paper].CASES]
    return [every[key] for key in order if key in every]


def unexplained(content):
    """Names of the results that differ from the theory, or from the paper without a stated cause."""
    return [result["name"] for case in content["cases"] for result in case["results"] if result["unexplained"]]
