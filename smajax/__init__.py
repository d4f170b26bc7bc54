"""smajax: differentiable shape-memory-alloy actuators, and the loop from measured runs to the missing effect."""

__version__ = "0.1.0"
