"""Kinds of evidence that frames hold: a room for each, and a plan that chooses."""
