"""``python -m vsj.fleet``."""

import sys

try:
    from .command import main
except ImportError as error:
    if error.name is None or error.name.startswith("vsj"):
        raise
    print(f"vsj.fleet: the package {error.name} is missing; expected: pip install './python[fleet]'", file=sys.stderr)
    sys.exit(2)

# Workers of a cluster on this machine import this module again.
if __name__ == "__main__":
    sys.exit(main())
