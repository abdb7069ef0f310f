"""The fault kit: it fails each call of a command to the system once, and judges what the command leaves."""
