"""Scans: replicas and parameter grids of runs on any executor of ``concurrent.futures``, their tables and figure."""

from typing import TYPE_CHECKING

__all__ = ["ScanResult", "read_scan", "scan"]

if TYPE_CHECKING:
    from .scan_file import read_scan
    from .scan_runs import ScanResult, scan
else:

    def __getattr__(name: str) -> object:
        # Loaded when they are asked for: the command line looks into this folder whatever it is asked to do.
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from . import scan_file, scan_runs

        return getattr(scan_file if name == "read_scan" else scan_runs, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
