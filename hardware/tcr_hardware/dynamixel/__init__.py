"""Dynamixel motors of the X series on a serial bus, protocol 2.0."""
