"""The wheel's tag: of any machine, or of the one whose compiled kernels it carries."""

import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Carried(BuildHookInterface):
    """Says that a wheel with compiled kernels is for this Python on this kind of machine."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Set the tag; an editable install carries nothing."""
        if version == "standard" and (Path(self.root) / "companion/kernels/carried/carried.json").is_file():
            python = f"cp{sys.version_info.major}{sys.version_info.minor}"
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["pure_python"] = False
            build_data["tag"] = f"{python}-{python}-{platform}"
