"""Tasks: what a run is for, beyond following its trajectory, with the geometry that it takes; one kind one file."""
