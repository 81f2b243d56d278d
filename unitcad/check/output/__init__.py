"""Reports written out: text, JSON, GitHub annotations, SARIF and JUnit XML, a module each."""
