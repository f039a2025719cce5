"""Data-set formats: each module exports a store in one."""
