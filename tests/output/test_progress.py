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
