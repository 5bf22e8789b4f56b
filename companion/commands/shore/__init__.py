"""The shore's end of a transfer: missions, fences and rally lists by MAVSDK, with deadlines and proof of life."""

from companion.commands.shore.shore import Shore
from companion.commands.shore.transfer import download_list, upload_and_compare

__all__ = ["Shore", "download_list", "upload_and_compare"]
