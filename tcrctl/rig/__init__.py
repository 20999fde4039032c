"""Work on a rig beside experiments: check, status, calibrate, zero, jog, reset; one verb one file."""
