"""What is on the wire: frames, messages as values and back, lists of items, streams, our own status."""
