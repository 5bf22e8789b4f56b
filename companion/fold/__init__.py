"""The companion without its shell: values in, snapshots, steps and actions out."""

from companion.fold.fold import Step, VoyageFold, Waters, begun

__all__ = ["Step", "VoyageFold", "Waters", "begun"]
