"""Files from bodies: STL and 3MF for printers, STEP for CAD, SVG, PNG and GLB to look at. Same input, same bytes."""
