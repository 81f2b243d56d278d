"""Files from bodies: STL and 3MF for the printer, STEP for CAD, SVG for the eye. Same input, same bytes."""
