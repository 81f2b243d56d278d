"""3MF: an OPC package of XML parts, read against the consortium's schemas."""
