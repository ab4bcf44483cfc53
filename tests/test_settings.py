"""What settings may be: numbers within a range, and a sentence that names what is not."""

from __future__ import annotations

import math

import pytest

from jet_gym.errors import JetGymError, SettingsError
from jet_gym.utils.settings import require_within


@pytest.mark.parametrize(
    ("value", "limits", "above"),
    [(0.0, (), False), (1e9, (), False), (1, (0.0, 1.0), False), (-2.0, (-2.0, 2.0), False), (1e-9, (), True)],
)
def test_numbers_within_the_range_pass(value, limits, above):
    require_within("gain", value, *limits, above=above)


@pytest.mark.parametrize(
    ("value", "limits", "above", "sentence"),
    [
        (-1e-9, (), False, "gain must be a finite number of 0 or more, not -1e-09"),
        (0.0, (), True, "gain must be a finite number of more than 0, not 0.0"),
        (0.0, (0.0, 5.0), True, "gain must be more than 0 and at most 5, not 0.0"),
        (5.1, (0.0, 5.0), False, "gain must lie between 0 and 5, not 5.1"),
        (math.inf, (), False, "gain must be a finite number of 0 or more, not inf"),
        (math.nan, (0.0, 1.0), False, "gain must lie between 0 and 1, not nan"),
        (True, (), False, "gain must be a number, not True"),
        ("2", (), False, "gain must be a number, not '2'"),
        (None, (), False, "gain must be a number, not None"),
    ],
)
def test_everything_else_is_refused_with_the_name_and_what_is_allowed(value, limits, above, sentence):
    with pytest.raises(SettingsError) as caught:
        require_within("gain", value, *limits, above=above)
    assert str(caught.value) == sentence
    assert isinstance(caught.value, JetGymError)
    assert isinstance(caught.value, ValueError)
