"""`python -m viewsphere`."""

from viewsphere.cli import program

if __name__ == "__main__":
    program()
