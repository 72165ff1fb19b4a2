"""Controllers, loops and what they are worth."""
