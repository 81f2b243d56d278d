"""Arrays: many units on one silicone sheet, with the sheet's moulds, their circuit and their crosstalk."""
