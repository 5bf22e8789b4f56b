"""Regret: the time that every sailor takes over the best that could have been made of the wind that she met."""
