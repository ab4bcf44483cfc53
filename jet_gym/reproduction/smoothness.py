"""The smoothness weight omega of eq. (18), whose unit the paper does not print."""

from __future__ import annotations

from agents.studies.sweep import sweep_smoothness
from jet_gym.figures import plot_smoothness_sweep, png_bytes
from jet_gym.reproduction.model import Chapter, Picture, Settings
from jet_gym.utils.progress import Progress


def smoothness_chapter(settings: Settings, report: Progress) -> Chapter:
    """Show how the unit of omega was settled."""
    rows = sweep_smoothness(settings.seeds(settings.study_plans), progress=report)
    return Chapter(
        "smoothness",
        "The smoothness weight",
        (
            "The paper prints omega = 50 and no unit. Per m² it does nothing, per mm² it freezes the pelvis; per "
            "cm² it trades thrust against smoothness, and that is what is taken.",
        ),
        pictures=(
            Picture(
                "smoothness-weight",
                "What the smoothness weight does",
                "Thrust and roughness of GAS over the smoothness weight, with GA beside it.",
                png_bytes(plot_smoothness_sweep(rows)),
            ),
        ),
    )
