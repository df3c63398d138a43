"""Pictures as values, and what their pixels show by themselves; no file format is known here."""
