"""What is said of a long task."""

import io

from openmm_cylchain.output.progress import ProgressMessages


def test_progress_goes_line_by_line_where_there_is_no_terminal():
    stream = io.StringIO()
    progress = ProgressMessages(stream)
    progress("one")
    progress("two")
    progress.finish()
    assert [line.split(" s  ")[1] for line in stream.getvalue().splitlines()] == ["one", "two"]


def test_messages_that_come_too_soon_are_left_out(monkeypatch):
    clock = iter([0.0, 1.0, 11.0, 12.0, 22.0])
    monkeypatch.setattr("openmm_cylchain.output.progress.time.monotonic", lambda: next(clock))
    stream = io.StringIO()
    progress = ProgressMessages(stream, seconds_between_lines=10.0)
    for number in range(4):
        progress(f"frame {number}")
    assert stream.getvalue() == "  11.0 s  frame 1\n  22.0 s  frame 3\n"
