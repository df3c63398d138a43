"""Image similarity maximisation: the methods of Takamatsu & Matsushita (2008)."""
