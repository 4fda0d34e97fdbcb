"""Scans: replicas and parameter grids of runs on any executor of ``concurrent.futures``, their tables and figure."""

from .scan_file import read_scan
from .scan_runs import ScanResult, scan

__all__ = ["ScanResult", "read_scan", "scan"]
