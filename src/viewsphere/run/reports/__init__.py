"""The lists and descriptions that commands print: formats, plug-ins, models and rigs."""
