"""Pages and pictures: what a reader sees."""
