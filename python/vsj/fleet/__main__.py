"""``python -m vsj.fleet``."""

import sys

try:
    from .command import main
except ImportError as error:
    if error.name is None or error.name.startswith("vsj"):
        raise
    sys.exit(f"vsj.fleet: the package {error.name} is missing; expected: pip install './python[fleet]'")

# Workers of a cluster on this machine import this module again.
if __name__ == "__main__":
    sys.exit(main())
