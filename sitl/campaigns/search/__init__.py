"""The search for failures: draws that are moved towards contact, in place of blind ones."""
