"""Data sets on disk in other formats, and the facts that a format needs to hold one."""
