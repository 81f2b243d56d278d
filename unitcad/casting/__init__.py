"""Casting: the procedure with its figures, the bill of materials, the fit coupon, and how they are written."""
