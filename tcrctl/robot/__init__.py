"""The robot: description (YAML) -> frozen arrays -> equations of motion, equilibrium, modes."""
