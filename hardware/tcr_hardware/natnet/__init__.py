"""Markers over NatNet, the UDP streaming protocol of OptiTrack Motive, versions 2.5 to 4.4 [NN24]."""
