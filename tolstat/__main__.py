"""``python -m tolstat`` is the command ``tolstat``."""

from tolstat.cli import main

if __name__ == "__main__":
    main()
