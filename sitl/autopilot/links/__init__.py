"""The autopilot's ports and what they are joined to: bytes, stream rates, routes, the voice on all of them."""
