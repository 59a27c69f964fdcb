"""`python -m studio` and `saia`: no command opens the window, a command goes to the command line."""

import sys

from studio.cli import main

if __name__ == "__main__":
    sys.exit(main())
