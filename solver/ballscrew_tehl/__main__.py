"""python -m ballscrew_tehl"""

from .applications.cli.main import main

if __name__ == "__main__":
    raise SystemExit(main())
