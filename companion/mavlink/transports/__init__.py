"""Bytes to and from an autopilot: LINK names, serial, UDP and TCP, and the key that signs."""
