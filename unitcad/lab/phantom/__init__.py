"""A skin phantom that any lab can cast: recipe, moulds, coupons, and the response that is to be expected."""
