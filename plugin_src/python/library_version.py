"""Prints the version of a library of OpenMM."""

import ctypes
import sys

version_of_library = ctypes.CDLL(sys.argv[1]).OpenMM_Platform_getOpenMMVersion
version_of_library.restype = ctypes.c_char_p
print(version_of_library().decode())
