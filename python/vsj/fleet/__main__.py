"""``python -m vsj.fleet``."""

import sys

# Workers on this machine run this module under another name, and need nothing of the command.
if __name__ == "__main__":
    try:
        from .command import main
    except ImportError as error:
        if error.name is None or error.name.startswith("vsj"):
            raise
        print(f"vsj.fleet: the package {error.name} is missing; expected: pip install './python[fleet]'", file=sys.stderr)
        sys.exit(2)
    sys.exit(main())
