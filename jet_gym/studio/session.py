"""One browser tab: what it asks for, what it is shown, and what works for it in the background."""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.errors import JetGymError
from jet_gym.plan import Plan
from jet_gym.robot import jet_hr1
from jet_gym.studio import planning
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.moment import describe_moment
from jet_gym.studio.motion import Motion
from jet_gym.studio.outputs import Outputs
from jet_gym.studio.own_models import read_model
from jet_gym.studio.page.controls import Change
from jet_gym.studio.page.panel import BALANCE_SPACE, Panel
from jet_gym.studio.page.plots import Plots
from jet_gym.studio.page.table import comparison_table
from jet_gym.studio.planner_threads import PlannerThreads
from jet_gym.studio.planning import Verdict, planner_label
from jet_gym.studio.playback import Playback
from jet_gym.studio.scene.balance_cloud import BalanceCloud, SpaceInputs
from jet_gym.studio.scene.stage import Stage

if TYPE_CHECKING:
    from viser import ClientHandle

    from jet_gym.leg import Vector
    from jet_gym.utils.arrays import Array

_FIRST_SHOWN = 0.72  # share of the step's time that a page shows at first


class Session:
    """What one tab has.

    Attributes:
        inputs: What is asked for.
        plan: The plan that is shown, if there is one yet.
        rival: The ghost's plan, if there is one.
        verdict: What was said of the step.
        replans: How many plans have been shown.
        closed: Whether the tab is.
        lock: Held by whoever changes what is shown.
        planners: The threads that plan.
        playback: What is played, and the moment that is shown.

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
        self.lock = threading.RLock()
        self._plan_inputs: Inputs | None = None  # what the plan was made from
        self._loaded: Plan | None = None  # the last plan that came from a file
        self._rival_motion: Motion | None = None
        self._others: dict[str, Plan] = {}  # plans in the table besides the two that are drawn
        self._moved_foot = "landing"
        self.closed = False
        self._build()
        name = f"studio-{client.client_id}"
        self.planners = PlannerThreads(self, name)
        self.playback = Playback(self._show_passing_moment, self.lock, f"{name}-player")
        self.playback.time = _FIRST_SHOWN * self.inputs.duration
        self.change(lambda inputs: inputs)

    def _build(self) -> None:
        gui = self._client.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.set_panel_label("Jet-HR1 studio")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(345)
        self.panel = Panel(gui, self.inputs, self)
        with self.panel.outputs_tab:
            self.outputs = Outputs(self, self._client)
        plots = gui.add_panel()
        self.plots = Plots(gui, plots.add_tab("Along the step", icon="chart-line"))
        plots.dock_left()
        plots.set_width(330)
        robot = self.inputs.robot or jet_hr1()
        self.stage = Stage(self._client.scene, robot, self._camera_position, self._dragged)
        self.cloud = BalanceCloud(self._client.scene, f"studio-{self._client.client_id}")

    def close(self) -> None:
        """End what works for the tab; may be called twice."""
        self.closed = True
        self.playback.player.close()
        self.planners.close()
        self.outputs.close()
        self.cloud.close()

    # ---- what a person does

    def change(self, change: Change, foot: str | None = None) -> None:
        """Change what is asked for, show it at once, and have it planned.

        Args:
            change: From the inputs to the new ones.
            foot: The foot that was moved, if one was.
        """
        with self.lock, self._client.atomic():
            before, self.inputs = self.inputs, change(self.inputs)
            self._moved_foot = foot or self._moved_foot
            self._others = {}
            self.playback.time *= self.inputs.duration / before.duration
            step = None
            try:
                step = self.inputs.step
                self.inputs.balance.parameters(step.robot)
            except JetGymError as error:
                self._say(planning.refused(error))
            self.stage.show_step(self.inputs, step)
            self.panel.show_inputs(self.inputs)
            self.outputs.forget()
            if step is not None:
                self.cloud.want(SpaceInputs(step.robot, step.swing, self.inputs.balance), step.support)
        if step is None:
            self.planners.drop()
        else:
            self.planners.submit(self.inputs)

    def play(self, playing: bool) -> None:
        """Let time pass, or not; at the end of the motion it begins again."""
        self.playback.player.playing = playing
        self.panel.show_playing(playing)

    def set_speed(self, speed: float) -> None:
        """Let time pass at a multiple of the robot's own."""
        self.playback.player.speed = speed

    def seek(self, time: float) -> None:
        """Show a time [s]."""
        with self.lock:
            self.playback.time = time
            self._show_moment(move_slider=False)

    def show_layer(self, layer: str, visible: bool) -> None:
        """Draw a part of the scene, or leave it out."""
        with self.lock:
            if layer == BALANCE_SPACE:
                self.cloud.visible = visible
            else:
                self.stage.show_layer(layer, visible)

    def compare_all(self) -> None:
        """Plan with every planner, one after the other, and put them into the table."""
        inputs = self.inputs

        def show(plan: Plan) -> bool:
            with self.lock:
                if self.inputs is inputs:
                    self._others[plan.planner] = plan
                    self._show_table()
                return self.inputs is inputs

        self.planners.plan_all(inputs, show)

    def load_model(self, name: str, content: bytes, trust: bool) -> None:
        """Add a policy of the user's own to the planners, and plan with it; in a thread: a .zip takes seconds."""

        def load() -> None:
            try:
                model = read_model(name, content, trust=trust)
            except Exception as error:  # whatever the file makes it raise
                self.panel.planning.show_outcome(str(error), good=False)
                return
            self.change(lambda inputs: inputs.with_model(model))
            self.panel.planning.show_outcome(f"{model.name} is in the planner menu and plans this step.")

        threading.Thread(target=load, name="studio-model", daemon=True).start()

    def show_loaded(self, plan: Plan) -> None:
        """Show a plan that was made elsewhere as it is; its step is planned anew once something is changed."""
        with self.lock, self._client.atomic():
            self.planners.drop()
            planner = plan.planner if plan.planner in self.inputs.planners else self.inputs.planner
            self.inputs = replace(self.inputs.with_step(plan.step), planner=planner, seed=plan.seed, rival=None)
            self.outputs.forget()
            self._others = {}
            self.playback.time = _FIRST_SHOWN * plan.step.duration
            self.stage.show_step(self.inputs, plan.step)
            self.panel.show_inputs(self.inputs)
            self._loaded = plan
            self.show_plans(self.inputs, plan, None)
            self._say(planning.judge(plan, self.inputs))

    def show_motion(self, motion: Motion) -> None:
        """Play this motion of the plan, the planned or the simulated one."""
        with self.lock:
            self.playback.motion = motion
            self._show_all(self.inputs)

    def _camera_position(self) -> Array:
        return np.array(self._client.camera.position, dtype=np.float64)

    def _dragged(self, foot: str, position: Vector) -> None:
        self.change(lambda inputs: inputs.moved(foot, position), foot)

    # ---- what the threads report

    def show_plans(self, inputs: Inputs, plan: Plan | None, rival: Plan | None) -> None:
        """Show a plan, a rival's plan, or both; a rival that is still asked for stays until its next plan."""
        with self.lock, self._client.atomic():
            if self.closed or self._overtaken(inputs):
                return
            stands_in = plan is not None and plan.planner != inputs.planner
            if plan is not None and not (stands_in and self._plan_inputs is inputs):
                self.plan, self._plan_inputs, self.playback.motion = plan, inputs, Motion.of_plan(plan)
                self.outputs.forget()
                self.stage.show_plan(plan)
                self.replans += 1
                if not plan.violated_points or self.verdict is None or self.verdict.kind in ("holds", "refused"):
                    self._say(planning.judge(plan, inputs))
            if rival is not None or self.rival is None or self.rival.planner != self.inputs.rival:
                self.rival = rival
                self._rival_motion = None if rival is None else Motion.of_plan(rival)
                self.stage.show_rival(rival)
            self._show_all(inputs)

    def _overtaken(self, inputs: Inputs | None) -> bool:
        """Tell whether something newer than what was made from these inputs is shown: a plan, or a refusal."""
        refused = self.verdict is not None and self.verdict.kind == "refused"
        return inputs is not self.inputs and (refused or self._plan_inputs is self.inputs)

    def explain(self, plan: Plan, verdict: Verdict) -> None:
        """Say why a plan violates constraints, if it is still shown."""
        with self.lock:
            if self.plan is plan and not self.closed and not self._overtaken(self._plan_inputs):
                self._say(verdict)

    def fail(self, inputs: Inputs, planner: str, reason: str) -> None:
        """Say that a planner could not plan."""
        with self.lock:
            if self.inputs is inputs and not self.closed:
                self._say(Verdict("refused", f"{planner_label(planner)} cannot plan this step: {reason}"))

    # ---- what is shown

    def _say(self, verdict: Verdict) -> None:
        """Tell a verdict, in red at the block that was moved if no posture exists."""
        self.verdict = verdict
        self.panel.show_verdict(verdict, "" if verdict.kind == "refused" else self._origin())
        self.stage.ground.mark(self._moved_foot if verdict.kind in ("infeasible", "refused") else None)

    def _origin(self) -> str:
        """Say where the plan that is shown comes from, unless the planner that is asked for made it here."""
        if self.plan is None:
            return ""
        shown = planner_label(self.plan.planner)
        if self.plan is self._loaded:
            return f"As loaded; planned by {shown}."
        if self.plan.planner == self.inputs.planner:
            return ""
        return f"{planner_label(self.inputs.planner)} is planning; meanwhile {shown} stands in for it."

    def _show_all(self, inputs: Inputs) -> None:
        motion = self.playback.motion
        if self.plan is None or motion is None:
            return
        self.panel.show_range(motion.start, motion.end, float(motion.time[1] - motion.time[0]))
        self._show_table()
        self._show_moment(move_cursor=False)
        self.plots.show(inputs, self.plan, self.rival, self.outputs.simulated, self.playback.time)

    def _show_table(self) -> None:
        shown = {plan.planner: plan for plan in (self.plan, self.rival) if plan is not None}
        self.panel.show_table(comparison_table(list((shown | self._others).values())))

    def _show_moment(self, move_slider: bool = True, move_cursor: bool = True) -> None:
        """Show the moment that the clock is at, in the scene and, where asked, at the slider and in the plots."""
        motion, time = self.playback.motion, self.playback.time
        if motion is None or self.plan is None:
            return
        pose = motion.at(time)
        simulated = self.outputs.simulated
        if simulated is not None and motion is not simulated.motion:
            simulated = None  # it is there, but the planned one is shown
        rival = None if self._rival_motion is None else self._rival_motion.at(time)
        limit = self.inputs.max_thrust
        with self._client.atomic():
            self.stage.place(pose, rival, self.plan.step.robot.max_thrust if limit is None else limit)
            if move_slider:
                self.panel.show_time(time)
            self.panel.show_moment(describe_moment(self.plan.step, time, pose, simulated))
            if move_cursor:
                self.plots.point_at(time)

    def _show_passing_moment(self, move_cursor: bool) -> None:
        with suppress(RuntimeError):  # the tab may have been closed in between
            if not self.closed:
                self._show_moment(move_cursor=move_cursor)
