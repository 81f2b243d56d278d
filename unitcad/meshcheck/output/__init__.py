"""Reports written out: text, JSON, GitHub annotations, SARIF, JUnit XML and Markdown, a module each."""
