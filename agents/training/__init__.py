"""What ``train.py`` is made of; needs the extra ``[train]``."""
