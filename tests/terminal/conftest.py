"""The short beat of ``tests.view``, to be drawn."""

from tests.view.conftest import beat

__all__ = ["beat"]
