"""Planning under way: why, from where, with which step of the ladder, and what is done with the answer."""
