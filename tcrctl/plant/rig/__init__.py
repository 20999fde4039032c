"""The real bench as a plant: cameras and drives, set-points within limits, the supervisor; rig files."""
