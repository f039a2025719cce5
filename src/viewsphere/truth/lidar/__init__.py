"""The measurements of a turning LiDAR."""
