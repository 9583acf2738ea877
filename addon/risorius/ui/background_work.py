# SPDX-License-Identifier: GPL-3.0-or-later
"""Base class of operators that work in a background task, which Esc cancels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ..scene.base.task import Task
from .blender_types import Context, Result

if TYPE_CHECKING:
    from .blender_types import Operator as _Base
else:
    _Base = object


class RunsBeside(_Base):
    """Base of operators that run a task in the background.

    Subclasses define `finish`, `shown` and `cancelled_text`.

    In scripts, in Blender's background mode and in the redo panel, the operator waits for the
    result of the task instead.
    """

    def wait_beside(self) -> None:
        """Let the next call of `begin` run its task in the background, if Blender has an interface.

        `invoke` calls this. An `execute` without `invoke`, as in a script, waits for the result
        of the task.
        """
        self._beside = not bpy.app.background

    def begin(self, context: Context, task: Task) -> Result:
        """Start the task in the background, or run it and wait.

        Args:
            context: context of the operator, with a window if the task runs in the background.
            task: the task of the operator.
        """
        self._running = task
        # The redo panel runs the same operator object again, and should wait for the result. So the
        # flag is cleared.
        beside, self._beside = getattr(self, "_beside", False), False
        if not beside:
            task.run()
            return self.finish(context)
        task.start()
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(0.1, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        """Blender calls this with each event: Esc cancels, the timer shows progress and finishes.

        Args:
            context: context of the operator.
            event: the current event.
        """
        if event.type == "ESC":
            self.cancel(context)
            self.report({"WARNING"}, self.cancelled_text())
            return {"CANCELLED"}
        if event.type == "TIMER":
            share = round(self._running.share * 100)
            context.window_manager.progress_update(share)
            context.workspace.status_text_set(self.shown(share))
            if not self._running.is_running():
                self._end(context)
                return self.finish(context)
        return {"PASS_THROUGH"}

    def cancel(self, context: Context) -> None:
        """Cancel the task; Blender also calls this method when Blender closes."""
        self._running.cancel()
        self._end(context)

    def _end(self, context: Context) -> None:
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        context.workspace.status_text_set(None)

    def finish(self, context: Context) -> Result:
        """Use the result of the ended task, or report the error of the task."""
        raise NotImplementedError

    def shown(self, share: int) -> str:
        """The text of the status bar while the task runs.

        Args:
            share: finished part of the task in per cent, 0 to 100.
        """
        raise NotImplementedError

    def cancelled_text(self) -> str:
        """The sentence that is reported after Esc has cancelled the task."""
        raise NotImplementedError
