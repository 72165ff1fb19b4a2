"""What is known of a servo: its datasheet, its model, and recordings simulated with known truth."""
