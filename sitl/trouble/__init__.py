"""Trouble: what is made to go wrong, with links, sensors, disks, processes and people."""
