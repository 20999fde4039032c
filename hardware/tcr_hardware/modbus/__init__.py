"""The drives behind a PLC: register map, word order, and the one exchange per control cycle over Modbus."""
