"""Whether the picture that the cameras give of the robot can be believed: before the drives are armed, and in motion."""
