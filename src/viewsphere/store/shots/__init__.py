"""The folders of shots: records, manifests, checksums, heartbeats."""
