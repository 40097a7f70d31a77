"""palette4d.exe: the command line."""

import sys

from palette4d.cli.main import main

sys.exit(main())
