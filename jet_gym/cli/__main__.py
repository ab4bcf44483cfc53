"""``python -m jet_gym.cli`` is ``jet-gym``."""

from jet_gym.cli import main

main()
