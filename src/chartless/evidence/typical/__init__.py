"""The typical curve of digital cameras, for pictures without evidence."""
