"""Parameters from recordings, by simulating them."""
