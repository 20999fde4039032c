"""Work on the real bench beside experiments: check, status, calibrate, zero, jog, reset; one verb one file."""
