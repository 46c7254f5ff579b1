"""What a studio and its commands load once they are asked to, for the process of which those of the tests are forks."""

import gc
from importlib import import_module

import numpy as np

from airborne.geometry.swing_twist import swing_twist_from_matrix

SERVING = (
    *("anyio._backends._asyncio", "nicegui.ui_run", "uvicorn.lifespan.on", "uvicorn.loops.auto"),
    *("uvicorn.protocols.http.auto", "uvicorn.protocols.websockets.wsproto_impl"),
)
PARTS = (
    *("button", "card", "checkbox", "dialog", "expansion", "input", "keyboard", "notification", "number", "select"),
    *("timer", "tooltip"),
)
TRACKING = (
    *("matplotlib.backends.backend_agg", "pyarrow.parquet", "airborne.export.figures", "airborne.export.sheet"),
    *("airborne.run.track", "airborne.run.find", "airborne.run.find_players", "airborne.run.export"),
)

for name in (*SERVING, *TRACKING):
    import_module(name)
for name in PARTS:
    import_module(f"nicegui.elements.{name}")
swing_twist_from_matrix(np.eye(3)[None])  # the first kernel loads more than the next ones
gc.freeze()
