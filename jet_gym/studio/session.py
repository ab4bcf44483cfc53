"""One browser tab: what it asks for, what it is shown, and what works for it in the background."""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from agents.planner import PLANNERS
from jet_gym.errors import JetGymError
from jet_gym.plan import Plan
from jet_gym.robot import jet_hr1
from jet_gym.studio import planning
from jet_gym.studio.curves import zmp_margin
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.motion import Motion, Pose
from jet_gym.studio.panel import Change, Panel, planner_label
from jet_gym.studio.planning import Verdict
from jet_gym.studio.player import Player
from jet_gym.studio.plots import Plots
from jet_gym.studio.robot_view import joints_near_limits
from jet_gym.studio.stage import Stage
from jet_gym.studio.table import comparison_table
from jet_gym.studio.worker import LatestWorker, Stale

if TYPE_CHECKING:
    from viser import ClientHandle

    from jet_gym.robot import Vector
    from jet_gym.urdf import Array

QUICK = (
    0.1  # [s] a planner that needs longer for a step does not follow a drag: GAS stands in for it until it is done
)
_STAND_IN = "gas"
_SETTLED = 0.15  # [s] without a change after which a slow planner is started
_FIRST_SHOWN = 0.72  # share of the step's time that a page shows at first
_PAUSE_AT_END = 1.2  # [s] before a motion that plays begins again


class Session:
    """What one tab has: its inputs, the plans made from them, and the threads that work for it.

    Planning happens in two threads: one plans with quick planners and keeps up with a drag; the other waits until
    the inputs have settled and runs the slow ones, while GAS stands in for them.

    Attributes:
        inputs: What is asked for.
        plan: The plan that is shown, if there is one yet.
        rival: The ghost's plan, if there is one.
        verdict: What was said of the step.
        replans: How many plans have been shown.

    Args:
        client: The tab.
        inputs: What it asks for at first.
    """

    def __init__(self, client: ClientHandle, inputs: Inputs | None = None) -> None:
        self.inputs = inputs or Inputs.of_motion("forward")
        self.plan: Plan | None = None
        self.rival: Plan | None = None
        self.verdict: Verdict | None = None
        self.replans = 0
        self._client = client
        self._lock = threading.RLock()
        self._pace: dict[str, float] = {_STAND_IN: 0.0}  # [s] a swing point takes
        self._motion: Motion | None = None
        self._rival_motion: Motion | None = None
        self._others: dict[str, Plan] = {}  # plans in the table besides the two that are shown
        self._time = _FIRST_SHOWN * self.inputs.duration
        self._moved_foot = "landing"
        self._closed = False
        self._build()
        name = f"studio-{client.client_id}"
        self.live = LatestWorker(self._plan_live, f"{name}-live")
        self.thorough = LatestWorker(self._plan_thorough, f"{name}-thorough", patience=_SETTLED)
        self.player = Player(self._advance, f"{name}-player")
        self.change(lambda inputs: inputs)

    def _build(self) -> None:
        gui = self._client.gui
        gui.configure_theme(
            show_logo=False, show_share_button=False, control_width="medium", brand_color=(0, 114, 178)
        )
        gui.set_panel_label("Jet-HR1 studio")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(345)
        self.panel = Panel(gui, self.inputs, self)
        plots = gui.add_panel()
        self.plots = Plots(gui, plots.add_tab("Along the step", icon="chart-line"))
        plots.dock_left()
        plots.set_width(330)
        robot = self.inputs.robot or jet_hr1()
        self.stage = Stage(self._client.scene, robot, self._camera_position, self._dragged)

    def close(self) -> None:
        """End what works for the tab; may be called twice."""
        self._closed = True
        self.player.close()
        self.live.close()
        self.thorough.close()

    def change(self, change: Change, foot: str | None = None) -> None:
        """Change what is asked for, show it at once, and have it planned.

        Args:
            change: From the inputs to the new ones.
            foot: The foot that was moved, if one was.
        """
        with self._lock, self._client.atomic():
            before, self.inputs = self.inputs, change(self.inputs)
            self._moved_foot = foot or self._moved_foot
            self._others = {}
            self._time *= self.inputs.duration / before.duration
            try:
                step, _ = self.inputs.step, self.inputs.balance.parameters(self.inputs.step.robot)
            except JetGymError as error:
                step = None
                self._say(planning.refused(error))
            self.stage.show_step(self.inputs, step)
            self.panel.show_inputs(self.inputs)
        if step is None:
            self.live.drop()
            self.thorough.drop()
        else:
            self.live.submit(self.inputs)
            self.thorough.submit(self.inputs)

    def play(self, playing: bool) -> None:
        """Let time pass, or not; at the end of the motion it begins again."""
        self.player.playing = playing
        self.panel.show_playing(playing)

    def set_speed(self, speed: float) -> None:
        """Let time pass at a multiple of the robot's own."""
        self.player.speed = speed

    def seek(self, time: float) -> None:
        """Show a time [s]."""
        with self._lock:
            self._time = time
            self._show_moment(move_slider=False)

    def show_layer(self, layer: str, visible: bool) -> None:
        """Draw a part of the scene, or leave it out."""
        with self._lock:
            self.stage.show_layer(layer, visible)

    def compare_all(self) -> None:
        """Plan with every planner, one after the other, and put them into the table."""
        threading.Thread(target=self._compare_all, args=(self.inputs,), daemon=True).start()

    def _camera_position(self) -> Array:
        return np.asarray(self._client.camera.position)

    def _dragged(self, foot: str, position: Vector) -> None:
        self.change(lambda inputs: inputs.moved(foot, position), foot)

    # ---- in the threads that plan

    def _is_quick(self, planner: str, points: int) -> bool:
        return planner in self._pace and self._pace[planner] * points < QUICK

    def _make_plan(self, planner: str, inputs: Inputs, stale: Stale) -> Plan | None:
        """Plan, note how long a swing point takes, and say so where it fails."""
        try:
            plan = planning.plan_with(planner, inputs, stale)
        except Exception as error:  # a planner may be anybody's, and the page must go on
            with self._lock:
                if inputs is self.inputs:
                    sentence = f"{planner_label(planner)} cannot plan this step: {error}"
                    self._say(Verdict("refused", sentence))
            return None
        if plan is not None and planner != _STAND_IN:
            self._pace[planner] = float(plan.solve_time.sum()) / plan.step.points
        return plan

    def _plan_live(self, inputs: Inputs, stale: Stale) -> None:
        """Plan with quick planners; a plan once begun is finished and shown, so that a drag is followed."""
        quick = self._is_quick(inputs.planner, inputs.points)
        plan = self._make_plan(inputs.planner if quick else _STAND_IN, inputs, lambda: False)
        if plan is None:
            return
        rival = None
        if inputs.rival is not None and self._is_quick(inputs.rival, inputs.points):
            rival = self._make_plan(inputs.rival, inputs, lambda: False)
        self._show_plans(inputs, plan, rival)
        if plan.violated_points:
            verdict = planning.explain(plan, inputs, stale)
            with self._lock:
                if verdict is not None and self.plan is plan:
                    self._say(verdict)

    def _plan_thorough(self, inputs: Inputs, stale: Stale) -> None:
        """Plan with the planners that are too slow for a drag, or whose speed is not known yet."""
        for planner in dict.fromkeys(filter(None, (inputs.planner, inputs.rival))):
            if self._is_quick(planner, inputs.points) and self._is_shown(planner):
                continue
            plan = self._make_plan(planner, inputs, stale)
            if plan is None or stale():
                return
            self._show_plans(
                inputs,
                plan if planner == inputs.planner else None,
                plan if planner == inputs.rival else None,
            )
            if planner == inputs.planner and plan.violated_points:
                verdict = planning.explain(plan, inputs, stale)
                with self._lock:
                    if verdict is not None and self.plan is plan:
                        self._say(verdict)

    def _is_shown(self, planner: str) -> bool:
        return any(plan is not None and plan.planner == planner for plan in (self.plan, self.rival))

    def _compare_all(self, inputs: Inputs) -> None:
        for planner in PLANNERS:
            plan = self._make_plan(planner, inputs, lambda: self._closed or self.inputs is not inputs)
            with self._lock:
                if self.inputs is not inputs:
                    return
                if plan is not None:
                    self._others[planner] = plan
                    self._show_table()

    # ---- what is shown

    def _show_plans(self, inputs: Inputs, plan: Plan | None, rival: Plan | None) -> None:
        """Show a plan, a rival's plan, or both; what is not given stays, if it is still asked for."""
        with self._lock, self._client.atomic():
            if self._closed:
                return
            if plan is not None:
                self.plan, self._motion = plan, Motion.of_plan(plan)
                self.stage.show_plan(plan)
                self.replans += 1
                if not plan.violated_points or self.verdict is None or self.verdict.kind in ("holds", "refused"):
                    self._say(planning.judge(plan, inputs))
            if rival is not None or inputs.rival is None or (self.rival and self.rival.planner != inputs.rival):
                self.rival = rival
                self._rival_motion = None if rival is None else Motion.of_plan(rival)
                self.stage.show_rival(rival)
            if self.plan is None:
                return
            self.panel.show_range(self.plan.step.duration, self.plan.step.duration / (self.plan.step.points - 1))
            rival_drawn = self.rival if self.rival is not None and self.rival.step.points else None
            self.plots.show(inputs, self.plan, rival_drawn, None)
            self._show_table()
            self._show_moment()

    def _say(self, verdict: Verdict) -> None:
        """Tell a verdict, in red at the block that was moved if no posture exists."""
        self.verdict = verdict
        stand_in = ""
        if self.plan is not None and verdict.kind != "refused" and self.plan.planner != self.inputs.planner:
            asked, shown = planner_label(self.inputs.planner), planner_label(self.plan.planner)
            stand_in = f"{asked} is planning; meanwhile {shown} stands in for it."
        self.panel.show_verdict(verdict, stand_in)
        self.stage.ground.mark(self._moved_foot if verdict.kind in ("infeasible", "refused") else None)

    def _show_table(self) -> None:
        shown = {plan.planner: plan for plan in (self.plan, self.rival) if plan is not None}
        self.panel.show_table(comparison_table(list((shown | self._others).values())))

    def _show_moment(self, move_slider: bool = True) -> None:
        """Show the moment that the clock is at."""
        if self._motion is None or self.plan is None:
            return
        time = min(max(self._time, 0.0), self._motion.duration)
        pose = self._motion.at(time)
        rival = None if self._rival_motion is None else self._rival_motion.at(time)
        limit = self.inputs.balance.parameters(self.plan.step.robot).max_thrust
        with self._client.atomic():
            self.stage.place(pose, rival, limit)
            if move_slider:
                self.panel.show_time(time)
            self.panel.show_moment(self._describe(time, pose))
            self.plots.point_at(time)

    def _describe(self, time: float, pose: Pose) -> list[str]:
        """Return what is the case at a moment, in lines."""
        assert self.plan is not None
        step = self.plan.step
        point = round(time / step.duration * (step.points - 1))
        margin = float(zmp_margin(step, pose.zmp[None])[0])
        where = (
            f"{1e3 * margin:.0f} mm inside the sole" if margin >= 0 else f"{-1e3 * margin:.0f} mm outside the sole"
        )
        lines = [
            f"swing point {point} of 0 to {step.points - 1}, {time:.2f} s",
            f"thrust {pose.thrust[0]:.1f} N, ZMP {where}",
        ]
        near = joints_near_limits(step.robot, pose.joint_positions)
        if near:
            names = ", ".join(f"{name.replace('_', ' ')} {np.degrees(room):.0f}°" for name, room in near[:3])
            lines.append(f"close to the end of its range: {names}")
        return lines

    def _advance(self, elapsed: float) -> None:
        """Let time pass on the page's clock; called by the player."""
        with self._lock, suppress(RuntimeError):  # the tab may have been closed in between
            if self._motion is None or self._closed:
                return
            self._time += elapsed
            if self._time > self._motion.duration + _PAUSE_AT_END * self.player.speed:
                self._time = 0.0
            self._show_moment()
