"""`python -m smachpy.sim` runs `smachpy robot`."""

import sys

from smachpy.command import main

sys.exit(main(["robot", *sys.argv[1:]]))
