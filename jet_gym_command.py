"""Where ``jet-gym`` starts: Ctrl-C is one sentence even while the package loads, which takes a moment."""

import os
import signal


def main() -> None:
    """Load the command line and run it."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:  # in the background it is ignored, and stays so
        signal.signal(signal.SIGINT, _stop)
    from jet_gym.cli import main as run

    signal.signal(signal.SIGINT, before)
    run()


def _stop(*_: object) -> None:
    """End at once: there is nothing yet to tidy up, and an exception would come out of the middle of an import."""
    os.write(2, b"jet-gym: interrupted\n")
    os._exit(130)
