"""``python -m rodfem`` is the program ``rodfem``."""

from rodfem.app.console import main

if __name__ == "__main__":
    main()
