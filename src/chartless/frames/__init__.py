"""Pictures as values, and what their pixels tell by themselves; no file format is known here."""
