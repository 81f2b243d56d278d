"""Casting moulds: the plan of pours, the tooling, the set that holds them."""
