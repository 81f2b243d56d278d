"""Constructions: ways to hold and cast the units of an array. Every file here that defines CONSTRUCTION is one."""
