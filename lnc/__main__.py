"""`python -m lnc`."""

import sys

from lnc.cli import main

sys.exit(main())
