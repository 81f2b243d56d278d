"""Signal chains: from a record to the amplitude of the motor's line, one file a chain."""
