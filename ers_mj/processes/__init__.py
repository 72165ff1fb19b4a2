"""This process among others: how a signal ends it, and what must not outlive it. Reads no other room."""
