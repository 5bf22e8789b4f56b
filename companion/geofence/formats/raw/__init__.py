"""Raw content: bytes as text, JSON and XML, within limits that a stranger's file cannot break."""
