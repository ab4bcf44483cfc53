"""What holds something that must be given back, and does so at the end of a ``with`` block."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TypeVar

Itself = TypeVar("Itself", bound="SelfClosing")


class SelfClosing(ABC):
    """Has a ``close()``, and calls it when a ``with`` block ends, whatever ended it."""

    @abstractmethod
    def close(self) -> None:
        """Give back what is held; a second time does nothing."""

    def __enter__(self: Itself) -> Itself:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
