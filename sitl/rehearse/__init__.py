"""Rehearsals: a user's own mission sailed many times before it is sailed, and what is known then."""
