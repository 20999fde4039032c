"""Plants: what is controlled, simulated or real; chosen by ``plant.kind``."""
