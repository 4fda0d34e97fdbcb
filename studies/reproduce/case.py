"""A part of a paper that is reproduced: one or several of its figures or tables."""

from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Outcome:
    """What a case has given.

    Attributes
    ----------
    results : list of Result
    pictures : dict of str to callable (matplotlib.figure.Figure)
        What draws each picture, by its title.
    remarks : str
        A paragraph for the page.
    files : dict of str to callable (Path)
        What writes each further file, by its path in the directory.
    """

    results: list
    pictures: dict = field(default_factory=dict)
    remarks: str = ""
    files: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A part of a paper.

    Attributes
    ----------
    key : str
        For the names of files.
    title : str
    figures : tuple of int
        Of the paper; empty for tables.
    evaluate : callable (Records, quick) -> Outcome
    """

    key: str
    title: str
    figures: tuple
    evaluate: Callable
