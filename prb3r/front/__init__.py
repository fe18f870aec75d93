"""The front door in Python: what goes in as files or objects comes out as objects that show what they say."""
