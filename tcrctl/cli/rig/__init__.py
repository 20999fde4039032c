"""``tcrctl rig``: work on a bench beside experiments. What moves or writes asks first, and has a dry mode."""
