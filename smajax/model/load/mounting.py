"""How the wire is mounted, which the load's end stop takes up at the start of a run."""

from __future__ import annotations

import abc

from smajax.model.types import Scalar


class MountingTerm(abc.ABC):
    """What an effect may change in the state at rest (`system.initial_state`)."""

    @abc.abstractmethod
    def loose_length(self) -> Scalar | float:
        """By how much the wire is longer than its way at the start of a run, m; of a load that rests on its end stop."""
