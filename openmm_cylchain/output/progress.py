"""What a long task is at: a line that is overwritten on a terminal, and lines now and then elsewhere."""

import sys
import time
from collections.abc import Callable
from typing import TextIO

from ..units.text import format_time, time_unit

_REFRESH_SECONDS = 0.2
_LINE_FRACTION = 0.1
_SECONDS_BETWEEN_LATE_MESSAGES = 2.0


class StatusLine:
    """Writes lines, each in place of the last one if the stream is a terminal: if it is ``in_place``."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.in_place = stream.isatty()
        self._width = 0

    def write(self, line: str) -> None:
        """Write a line."""
        if self.in_place:
            self._stream.write("\r" + line.ljust(self._width))
            self._width = len(line)
        else:
            self._stream.write(line + "\n")
        self._stream.flush()

    def end(self) -> None:
        """Leave the line that was written last, if there is one."""
        if self.in_place and self._width:
            self._stream.write("\n")
            self._stream.flush()


class ProgressMessages:
    """Says what a task is at, with the time since its beginning, on standard error if no stream is given.

    Messages that come sooner after a line than ``seconds_between_lines`` are left out, but not on a terminal.
    """

    def __init__(self, stream: TextIO | None = None, seconds_between_lines: float = 0.0) -> None:
        self._line = StatusLine(sys.stderr if stream is None else stream)
        self._between = seconds_between_lines
        self._start = time.monotonic()
        self._next = self._start + seconds_between_lines

    def __call__(self, message: str) -> None:
        now = time.monotonic()
        if self._line.in_place or now >= self._next:
            self._next = now + self._between
            self._line.write(f"{now - self._start:6.1f} s  {message}")

    def finish(self) -> None:
        """Leave the line that was overwritten."""
        self._line.end()


class LateMessages:
    """Says how many parts of a task are done, if it is not soon done: more and more rarely, since some take minutes.

    ``text`` has two braces, for the number of parts that are done and of all; ``clock`` tells seconds.
    """

    def __init__(
        self, say: Callable[[str], None], text: str, parts: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._say, self._text, self._parts, self._clock = say, text, parts, clock
        self._done = 0
        self._start = clock()
        self._next = self._start + _SECONDS_BETWEEN_LATE_MESSAGES

    def one_is_done(self) -> None:
        """Count one more part."""
        self._done += 1
        now = self._clock()
        if now >= self._next:
            self._next = now + max(_SECONDS_BETWEEN_LATE_MESSAGES, 0.5 * (now - self._start))
            self._say(self._text.format(self._done, self._parts))


class RunProgress:
    """Reports how far a run is, how fast it goes and how long it will take, on standard output.

    ``end`` is the time in ps at which the whole run ends, of which this part starts from ``begin``.
    """

    def __init__(self, end: float, begin: float) -> None:
        self._end = end
        self._begin = self._time = begin
        self._line = StatusLine(sys.stdout)
        self._start = time.monotonic()
        self._last_refresh = self._start
        self._next_fraction = begin / end + _LINE_FRACTION

    def update(self, simulated: float) -> None:
        """Report that the run has come to a time in ps, if there is reason to report."""
        now, self._time = time.monotonic(), simulated
        if self._line.in_place:
            if now - self._last_refresh >= _REFRESH_SECONDS:
                self._last_refresh = now
                self._line.write(self._text(now))
        elif simulated / self._end >= self._next_fraction and simulated < self._end:
            self._next_fraction = simulated / self._end + _LINE_FRACTION
            self._line.write(self._text(now))

    def finish(self) -> None:
        """Report the end of the run, or of this part of it."""
        self._line.write(self._text(time.monotonic()))
        self._line.end()

    def _text(self, now):
        unit, length = time_unit(self._end)
        line = f"{100.0 * self._time / self._end:5.1f} %  {self._time / length:.4g} of {self._end / length:.6g} {unit}"
        elapsed = now - self._start
        done = self._time - self._begin
        if done == 0 or elapsed <= 0:
            return line
        line += f"  {format_time(done / elapsed, 3)}/s"
        if self._time == self._end:
            return f"{line}  took {_clock(elapsed)}"
        return f"{line}  {_clock(elapsed * (self._end - self._time) / done)} left"


def _clock(seconds):
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}"
