"""``python studies benchmark ...`` and ``python studies reproduce ...``, from a clone, with the package installed."""

import sys

from command_line import main

sys.exit(main())
