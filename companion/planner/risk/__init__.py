"""The risk of a plan: from the wind over its whole length, and from vessels that are not sure."""
