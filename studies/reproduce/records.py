"""Measurements that are kept in files, so that none is made twice and a run that is killed loses one at most."""

import json
import time
from pathlib import Path

import numpy as np

from openmm_cylchain.output.files import write_atomically
from openmm_cylchain.version import __version__


class Records:
    """Measurements in a directory.

    Parameters
    ----------
    directory : str or Path
        Created if it does not exist.
    force : bool
        Measure anew what is there.
    say : callable (str), optional
        Told what is measured.

    Attributes
    ----------
    directory : Path
    seconds : float
        That measurements took.
    """

    def __init__(self, directory, force=False, say=lambda message: None):
        self.directory = Path(directory)
        self.directory.mkdir(parents=True, exist_ok=True)
        self._force = force
        self._say = say
        self.seconds = 0.0

    def measure(self, name, function, **settings):
        """What ``function(**settings)`` returns, from the file ``name`` if it holds just that.

        Parameters
        ----------
        name : str
        function : callable
            Returns a dict of numbers and arrays. Its name and those of the settings, their values and the version of
            this package decide whether a file holds what is asked for.
        **settings
            Numbers, strings and lists of them.

        Returns
        -------
        dict of str to float or array
        """
        path = self.directory / f"{name}.json"
        asked = {"measurement": function.__name__, "settings": settings, "version": __version__}
        asked = json.loads(json.dumps(asked))
        content = None if self._force else _read(path)
        if content is None or {key: content.get(key) for key in asked} != asked:
            self._say(name)
            start = time.monotonic()
            data = {key: np.asarray(value).tolist() for key, value in function(**settings).items()}
            content = {**asked, "seconds": time.monotonic() - start, "data": data}
            write_atomically(path, (json.dumps(content, allow_nan=False) + "\n").encode())
        self.seconds += content["seconds"]
        return {key: np.asarray(value)[()] for key, value in content["data"].items()}


def _read(path):
    try:
        return json.loads(path.read_text())
    except (FileNotFoundError, json.JSONDecodeError):
        return None
