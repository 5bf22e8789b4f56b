"""What the autopilot understands and tells over MAVLink, message by message."""
