"""How far a unit's vibration travels: a layered half-space solved exactly, and closed-form estimates of the edge level.

numpy and scipy only; SI inside. Knows nothing of CAD, nor of the spec.
"""
