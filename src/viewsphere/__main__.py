"""`python -m viewsphere`."""

from viewsphere.cli import main

if __name__ == "__main__":
    main()
