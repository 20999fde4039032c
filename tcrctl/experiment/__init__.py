"""An experiment: its file, whether it can be done, its preparation and run, and what the run leaves behind."""
