"""What is on board the autopilot: whose it is, which mission it carries, and putting another there."""
