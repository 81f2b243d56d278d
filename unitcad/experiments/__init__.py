"""What to measure next: rival models, the ratios that a lab can measure, and what each would say about the rivals.

Files, lowest first: `information` (expected information and its error), `draws` (what is not known), `rivals`,
`protocol` (conditions and ratios), `lab_file` (what a lab has), `measured_units`, `conditioning` (draws held to
measured levels), `ranking`, `study`, `most_telling`.
"""
