"""Signals that end a run after a checkpoint."""

import signal
import threading


class Signals:
    """Notes SIGINT and SIGTERM instead of dying at once; a second one of either kills as usual.

    A context manager, whose ``received`` is the number of the first one, or None.
    """

    def __init__(self):
        self.received = None
        self._previous = {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._previous[number] = signal.signal(number, self._note)
        return self

    def _note(self, number, frame):
        self.received = number
        for either in self._previous:
            signal.signal(either, signal.SIG_DFL)

    def __exit__(self, *exception):
        for number, handler in self._previous.items():
            signal.signal(number, handler)
