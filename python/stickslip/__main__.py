"""``python -m stickslip`` is the command ``stickslip``."""

import sys

from stickslip.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
