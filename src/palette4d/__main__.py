"""``python -m palette4d``: the same as the command ``palette4d``."""

import sys

from palette4d.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
