"""Crosslinkers and motors: linkers whose hands bind to filaments, walk along them and unbind."""
