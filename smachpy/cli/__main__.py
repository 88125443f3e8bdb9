"""`python -m smachpy.cli` is the `smachpy` command."""

import sys

from smachpy.cli import main

sys.exit(main())
