"""Benchmarks: the speed of the engines beside stock OpenMM, and how cost and memory grow with size."""
