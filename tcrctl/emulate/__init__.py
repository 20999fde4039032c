"""A bench without a bench: emulated cameras and PLCs round simulated robots, and what goes wrong with them."""
