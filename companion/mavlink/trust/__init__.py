"""Who speaks on a link, which of it is ours to hear, and what of that is believed. Pure."""
