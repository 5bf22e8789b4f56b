"""Kernels: the functions that numba compiles, and where their machine code is kept.

``@kernel`` (``jit``) is the only way to compile a function here. What is compiled is kept in a folder under a name made
of all that the machine code depends on (``stamp``, ``cache``): an edit of a callee in another file, or of a constant,
asks for another file, so stale code cannot be loaded. The code is made for the processor's plain family, so that a
package can carry it, and a plan is the same on every machine of one kind. ``build`` compiles ahead what a voyage needs
(``listed``); importing it, or this, does not load numba.
"""
