"""Stand-ins for the devices of the bench, with encoders of their own."""
