"""Whether the cameras' picture of the robot can be believed: before the drives are armed, and in motion."""
