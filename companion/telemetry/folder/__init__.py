"""The folder that a voyage leaves: what is written while it is sailed, and read again."""
