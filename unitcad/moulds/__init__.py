"""Casting moulds: the plan of pours, the tooling, the set of both."""
