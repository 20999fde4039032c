"""Controllers: estimate and reference -> drive speeds; chosen by ``controller.kind``."""
