"""Palette4D Studio.exe: the window, with the sidecar that was dropped on it."""

import sys

from palette4d.cli.main import main

sys.argv.insert(1, "studio")
sys.exit(main())
