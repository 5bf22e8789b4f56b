"""The papers' own planners: Büsser's A* and Wolsieffer's RRT*, as references."""
