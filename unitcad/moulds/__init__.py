"""Casting moulds: the plan of pours, the tooling, the laws that they keep."""
