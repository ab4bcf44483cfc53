"""``jet-gym studio``: a page in the browser where a step is dragged and the robot follows.

Every browser tab is a :class:`~jet_gym.studio.session.Session` of its own: what it asks for
(:mod:`~jet_gym.studio.inputs`), a worker that plans it in the background (:mod:`~jet_gym.studio.worker`,
:mod:`~jet_gym.studio.planning`), what is drawn (:mod:`~jet_gym.studio.scene`), and what stands around it and can
be set (:mod:`~jet_gym.studio.page`).

``viser`` is imported when a page is served, so that everything else works without it.
"""
