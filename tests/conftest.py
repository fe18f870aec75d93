"""Its presence puts this folder on the import path: `prototype.py` builds the chains that many tests share."""
