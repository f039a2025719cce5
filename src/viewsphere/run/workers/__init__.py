"""Worker processes of this machine: their number, start, tasks and end."""
