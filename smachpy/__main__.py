"""`python -m smachpy` is the `smachpy` command."""

import sys

from smachpy.command import main

sys.exit(main())
