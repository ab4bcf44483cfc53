"""Gymnasium environments; importing :mod:`jet_gym` registers them."""
