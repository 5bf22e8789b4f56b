"""The editor: a mission drawn in a browser, checked and planned as it is drawn, saved as the file it came from."""
