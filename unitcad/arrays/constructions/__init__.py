"""Constructions: ways to fasten and cast the units of an array. Every file here that defines CONSTRUCTION is one."""
