"""Exports: the form of most formats, their files and pictures, sequences, and the limits beyond which formats refuse data
sets.
"""
