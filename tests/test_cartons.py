"""Cartons and their plinths: what stands where, and what is out of the way."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from jet_gym import Step
from jet_gym.courses import CARTON_HEIGHT

pytest.importorskip("pybullet")

from jet_gym.simulation.bullet import connect
from jet_gym.simulation.cartons import Cartons

SUPPORT = (0.0, 0.0, 0.0)


@pytest.fixture
def cartons() -> Iterator[Cartons]:
    """Cartons as in PyBullet's window, with their plinths."""
    client = connect()
    yield Cartons(client, visible=True)
    client.disconnect()


def plinths(cartons: Cartons) -> dict[float, float]:
    """Return heights of the plinths' tops by where they are to the left [m], those that are to be seen."""
    client = cartons._client
    known = {cartons.floor, *cartons.bodies.values()}
    places = [
        client.getBasePositionAndOrientation(body)[0] for body in range(client.getNumBodies()) if body not in known
    ]
    return {round(y, 2): z for _, y, z in places if z > -10.0}


def middle(cartons: Cartons, role: str) -> float:
    return round(cartons._client.getBasePositionAndOrientation(cartons.bodies[role])[0][1], 2)


class TestPlinths:
    def test_a_cleared_carton_takes_its_plinth_along(self, cartons):
        cartons.place(Step("left", (0.0, 0.24, 0.05), (0.12, 0.26, 0.0), SUPPORT))
        assert plinths(cartons) == {middle(cartons, "start"): pytest.approx(0.05 - CARTON_HEIGHT)}
        cartons.clear_start()
        assert plinths(cartons) == {}

    def test_a_cleared_carton_that_was_the_lowest_leaves_the_others_their_plinths(self, cartons):
        cartons.place(Step("left", (0.0, 0.24, -0.03), (0.12, 0.26, 0.05), SUPPORT))
        before = plinths(cartons)
        assert before == {
            middle(cartons, "support"): pytest.approx(-CARTON_HEIGHT),
            middle(cartons, "landing"): pytest.approx(0.05 - CARTON_HEIGHT),
        }
        cartons.clear_start()
        assert plinths(cartons) == before
        client = connect()
        seen = Cartons(client, visible=True)
        seen.copy(cartons)
        assert plinths(seen) == before
        client.disconnect()
