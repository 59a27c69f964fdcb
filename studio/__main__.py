"""`python -m studio` and `saia`: no command opens the window, a command goes to the command line."""

import sys

from studio import launch

# First of all: argparse.py may lie there as well.
launch.distrust_current_folder()


def main() -> int:
    """Run one command, or open the window; gives the exit code."""
    try:
        from studio.cli import main as run

        return run()
    except KeyboardInterrupt:
        # While the command line was still being loaded; from then on it answers itself.
        sys.stderr.write("Interrupted. Nothing that was saved is lost.\n")
        return 130


if __name__ == "__main__":
    sys.exit(main())
