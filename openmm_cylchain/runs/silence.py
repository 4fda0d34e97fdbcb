"""Silence of C libraries."""

import contextlib
import ctypes
import os
import sys


@contextlib.contextmanager
def silenced_c_library():
    """A context in which what C libraries print is lost: mdtraj's reader of DCD files prints two lines."""
    if os.name != "posix":
        yield
        return
    sys.stdout.flush()
    standard_output, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        ctypes.CDLL(None).fflush(None)
        os.dup2(standard_output, 1)
        os.close(standard_output)
        os.close(nowhere)
