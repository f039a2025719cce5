"""A cluster of Ray nodes on this machine, one CPU each, all of whose processes end with the context."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_DISABLE_IMPORT_WARNING": "1",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_CLIENT_SERVER_CHECK_CHANNEL_TIMEOUT_S": "120",
}
"""Nothing is told to Ray's makers, nor warned of; a busy machine may take its time."""

SMALL = {"num_cpus": 1, "object_store_memory": 80_000_000, "include_dashboard": False}
"""Of a node."""


@contextmanager
def ray_cluster(**head) -> Iterator:
    """A cluster with a first node; `ray.cluster_utils.Cluster` says how others are added and killed."""
    place = tempfile.mkdtemp(prefix="ray-", dir="/tmp")  # the names of sockets may not be long
    with patch.dict(os.environ, QUIET | {"RAY_TMPDIR": place, "PYTEST_RAY": str(os.getpid())}):
        from ray.cluster_utils import Cluster

        cluster = Cluster()
        try:
            cluster.add_node(**SMALL | head)
            yield cluster
        finally:
            cluster.shutdown()
            shutil.rmtree(place, ignore_errors=True)
