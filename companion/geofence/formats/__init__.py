"""Every file format that carries fences, obstacles and missions."""
