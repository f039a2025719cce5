"""What a turning LiDAR measures."""
