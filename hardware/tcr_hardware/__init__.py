"""Devices of the bench: cameras and drives. Speaks wire formats, knows nothing of control.

``natnet`` receives the markers of an OptiTrack system, ``modbus`` moves the cable drives through a PLC,
``emulators`` stands in for both. Positions in metres, times in seconds of ``time.monotonic``; what a wire
format calls otherwise carries its unit in the name.
"""
