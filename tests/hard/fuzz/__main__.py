"""``python -m tests.hard.fuzz``."""

from .worker import main

if __name__ == "__main__":
    main()
