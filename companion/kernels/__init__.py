"""Kernels: the functions that numba compiles, and where their machine code is kept.

``@kernel`` (``jit``) is the only way to compile a function here. In a clone numba compiles it when it is called, or
ahead (``build``), and keeps it in a file of its own cache whose name has a digest of all that the machine code depends
on (``stamp``, ``cache``): an edit of a callee in another file, or of a constant, asks for another file, so stale code
cannot be loaded. A package carries an extension module with all listed kernels (``listed``, ``carry``), which is called
without numba (``carried``). The code is made for the processor's plain family, so that a package can carry it, and a
plan is the same on every machine of one kind. Importing this does not load numba.
"""
